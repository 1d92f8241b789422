"""POD and sampling schedules."""
