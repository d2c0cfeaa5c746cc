"""The push of a tool on tissue: a log barrier in the gap, continued quadratically where the gap is small.

Per area: e(d) = p g B(d / g) with B(u) = -(u - 1)^2 ln u (Li et al., "Incremental Potential Contact", ACM TOG 2020)
for u < 1 and 0 beyond; below u = 0.1 its second-order Taylor polynomial, so that energy and force stay finite for
tissue that is inside a tool and push it out.
"""

from __future__ import annotations

import numpy as np

from ..ground.checks import Array

CONTINUED = 0.1


def barrier(gap: Array, width: float, pressure: float) -> tuple[Array, Array, Array]:
    """e in J/m^2, e' in Pa, e'' in Pa/m, of gaps (...) in m; ``width`` g in m, ``pressure`` p in Pa."""
    u = gap / width
    inside = np.clip(u, CONTINUED, 1.0)
    log, w = np.log(inside), inside - 1.0
    value = -(w**2) * log
    slope = -2 * w * log - w**2 / inside
    curvature = -2 * log - 4 * w / inside + (w / inside) ** 2
    below = np.minimum(u - CONTINUED, 0.0)
    value = value + below * (slope + 0.5 * below * curvature)
    slope = slope + below * curvature
    return pressure * width * value, pressure * slope, np.where(u < 1, pressure / width * curvature, 0.0)
