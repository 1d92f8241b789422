"""The frames on the bus."""
