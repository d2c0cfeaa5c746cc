"""Floor 7: the registered organ and its file."""
