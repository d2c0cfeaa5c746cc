"""Floor 9: surfaces, reports and pictures."""
