"""What a simulation gets wrong: compare, name, extend, measure."""
