"""The matrices of a step are small: BLAS threads beside them cost tenfold time, so they rest meanwhile.

One search for the loaded libraries serves all calls; ``threadpool_limits`` would search anew each time, which takes
longer than many a step.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, wraps
from typing import Any, ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")


def one_blas_thread(work: Callable[P, R]) -> Callable[P, R]:
    """``work`` with one BLAS thread, then as many again as before."""

    @wraps(work)
    def alone(*args: P.args, **kwargs: P.kwargs) -> R:
        with _libraries().limit(limits=1, user_api="blas"):
            return work(*args, **kwargs)

    return alone


@cache
def _libraries() -> Any:
    import scipy.linalg  # noqa: F401  the search finds what is loaded: numpy's BLAS and scipy's own
    from threadpoolctl import ThreadpoolController  # here: Slicer installs it on first use, after this file is loaded

    return ThreadpoolController()
