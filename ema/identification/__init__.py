"""From an envelope to faults with uncertainties."""
