"""An HF actuator on the bus."""
