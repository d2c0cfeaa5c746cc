"""Floor 3: coarse, rigid and global alignment."""
