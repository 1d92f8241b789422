"""Service units shipped with the project."""
