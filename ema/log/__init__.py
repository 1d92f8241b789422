"""MCAP logs: write, read, recover."""
