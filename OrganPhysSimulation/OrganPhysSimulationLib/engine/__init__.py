"""The running simulation without Slicer: numpy in, numpy out."""
