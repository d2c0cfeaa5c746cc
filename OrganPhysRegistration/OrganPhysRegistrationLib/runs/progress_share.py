"""One progress bar over all requests of a run."""

from __future__ import annotations

from collections.abc import Sequence

SHARES = {"prepare": 0.5, "load": 1.0, "coarse": 3.0, "rigid": 1.0, "elastic": 4.0, "results": 0.5}  # seconds, about


class ProgressShare:
    """Fraction of the whole run; it never goes back."""

    def __init__(self, parts: Sequence[str]) -> None:
        total = sum(SHARES[part] for part in parts)
        self._parts = {part: SHARES[part] / total for part in parts}
        self._begin = dict(zip(parts, _running_sum(list(self._parts.values())), strict=True))
        self.fraction = 0.0

    def advance(self, part: str, fraction: float) -> float:
        """The whole run's fraction (0..1) when ``part`` has come to ``fraction`` (0..1)."""
        reached = self._begin[part] + self._parts[part] * min(max(fraction, 0.0), 1.0)
        self.fraction = max(self.fraction, reached)
        return self.fraction


def _running_sum(lengths: list[float]) -> list[float]:
    return [sum(lengths[:k]) for k in range(len(lengths))]
