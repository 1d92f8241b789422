"""One physical term per file."""
