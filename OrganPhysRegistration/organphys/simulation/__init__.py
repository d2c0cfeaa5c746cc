"""Floor 8: the simulator, from a saved asset alone: metres, kilograms, seconds, newtons, pascals."""
