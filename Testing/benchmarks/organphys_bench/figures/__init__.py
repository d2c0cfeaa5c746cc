"""The numbers of one run, the same for every method."""
