"""Floor 1: frozen records of point sets, and sampling of them."""
