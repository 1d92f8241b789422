"""Units, names, configuration, errors and records: what everything else stands on."""
