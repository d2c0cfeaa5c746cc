"""What the residuals of the data say about its noise: their variance and how many of them are independent."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import pdist

from ..ground.checks import Array

SAMPLE = 1000
REACH, BINS = 0.6, 30  # normalised lengths within which correlation is looked for
FADED = 0.05  # correlation that counts as none
FEWEST = 30  # pairs of a bin whose mean says something


@dataclass(frozen=True)
class ResidualStatistics:
    """variance: weighted mean square, in the residuals' unit squared; independent: effective number of them."""

    variance: float
    independent: float


def residual_statistics(points: Array, residuals: Array, weights: Array, *, seed: int = 0) -> ResidualStatistics:
    """Of residuals (K,) with weights (K,) at points (K, 3) of the normalised frame.

    Neighbouring residuals repeat each other (smooth reconstruction errors, what the basis cannot follow). N correlated
    ones tell the mean as well as N^2 / sum_ij rho(|x_i - x_j|) independent ones (the design effect; Kish, "Survey
    Sampling", 1965; Bayley and Hammersley 1946); rho is their own correlation, averaged over distance bins up to the
    first that has faded. A sample drawn by weight stands for all.
    """
    share = weights / weights.sum()
    variance = float(share @ residuals**2)
    count = min(SAMPLE, int((share > 0).sum()))
    drawn = np.random.default_rng(seed).choice(len(share), count, replace=False, p=share)
    value = residuals[drawn] / max(float(np.sqrt((residuals[drawn] ** 2).mean())), 1e-300)
    bins = np.minimum((pdist(points[drawn]) * (BINS / REACH)).astype(np.int64), BINS)
    i, j = np.triu_indices(count, 1)
    pairs = np.bincount(bins, minlength=BINS + 1)[:BINS]
    products = np.bincount(bins, value[i] * value[j], minlength=BINS + 1)[:BINS]
    rho = np.where(pairs >= FEWEST, products / np.maximum(pairs, 1), 0.0)
    faded = (pairs >= FEWEST) & (rho < FADED)
    end = int(np.argmax(faded)) if faded.any() else BINS
    repeated = 2 * float((np.maximum(rho[:end], 0.0) * pairs[:end]).sum())
    return ResidualStatistics(variance, count**2 / (count + repeated))
