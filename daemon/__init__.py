"""The monitor: bus source, cycle assembly, identification, sinks."""
