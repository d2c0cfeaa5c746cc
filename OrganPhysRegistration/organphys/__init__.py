"""OrganPhys: a CT organ brought into an endoscopic Gaussian splat, rigidly and elastically."""

__version__ = "0.1.0"
