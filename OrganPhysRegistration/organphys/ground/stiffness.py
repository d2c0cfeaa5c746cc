"""How far an organ may deform: the weight alpha of the prior at the end of a registration; larger is stiffer."""

from __future__ import annotations

PRESET_ALPHA = {"conservative": 0.03, "moderate": 0.009, "aggressive": 0.003}
ALPHA_RANGE = (0.001, 0.2)
