"""Floor 0: frames, argument checks, notices, progress and solver reports. Imports numpy only."""
