"""Things drawn in the 3D views that are no nodes."""
