"""How the pipeline uses the processor."""

from __future__ import annotations

import sys

import scipy.linalg  # noqa: F401  threadpoolctl limits what is loaded by then: numpy's BLAS and scipy's own
from threadpoolctl import threadpool_limits

# The matrices are small and the stages bring their own two threads: BLAS threads beside them cost tenfold time.
one_blas_thread = threadpool_limits.wrap(limits=1, user_api="blas")


def peak_memory_mb() -> float | None:
    """Largest resident memory of this process so far, MB; None where the system does not tell (Windows)."""
    try:
        import resource
    except ImportError:
        return None
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / (2**20 if sys.platform == "darwin" else 2**10)
