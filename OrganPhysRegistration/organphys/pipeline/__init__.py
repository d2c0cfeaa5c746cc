"""Floor 10: the stages put together, and the command line."""
