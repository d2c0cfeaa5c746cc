"""Methods x cases x conditions, each in a process of its own, one file per finished run."""
