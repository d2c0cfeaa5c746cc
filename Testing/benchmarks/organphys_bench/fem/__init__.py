"""Finite elements for the elastic ICP that OrganPhys is compared with: linear tetrahedra, sparse Newton."""
