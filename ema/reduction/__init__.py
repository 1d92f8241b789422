"""POD of the snapshots and sampling schedules: which instants of a cycle are worth keeping."""
