"""Functions at the contact samples, evaluated patch by patch when a tool first comes near."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import Array
from .contact_samples import ContactSamples


class SampleBasis:
    """Values (k, n) of ``size`` n functions of points (k, 3), m, at contact samples; each patch is evaluated once and
    always alone, so that its values do not depend on what else was asked for."""

    def __init__(self, phi: Callable[[Array], Array], size: int, samples: ContactSamples) -> None:
        self._evaluate, self._samples = phi, samples
        self._phi = np.empty((len(samples.points), size))
        self._known = np.zeros(len(samples.middle), dtype=bool)

    def rows(self, samples: NDArray[np.int64]) -> Array:
        """Values (k, n) at the samples (k,)."""
        starts = self._samples.starts
        patches = np.unique(np.searchsorted(starts, samples, side="right") - 1)
        for patch in patches[~self._known[patches]]:
            part = slice(starts[patch], starts[patch + 1])
            self._phi[part] = self._evaluate(self._samples.points[part])
            self._known[patch] = True
        return self._phi[samples]
