"""Frames on the bus: DBC-derived codec, protection, interface choice."""
