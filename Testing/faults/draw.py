"""Which fault a trial gets: by its number and the seed alone, so that a campaign can go on where it stopped."""

from __future__ import annotations

import numpy as np
from injected import MEGABYTE, Fault
from trial import Size

SHARES = {
    "kill": 40, "half": 20, "full": 10, "large": 6, "disk": 6, "interrupt": 9, "memory": 4, "read-only": 2,
    "two at once": 5,
}  # fmt: skip
WHOLE = ("kill timed", "interrupt timed", "memory, whole")  # take as long as the command itself
WHOLE_NAMES = ("register", "simulate")
EVERY = 10  # trials: one of so many runs the whole command


def draw(seed: int, number: int, names: tuple[str, ...], sizes: dict[str, Size], *, mounts: bool) -> tuple:
    """(command, fault, whether older results lie there) of a trial."""
    rng = np.random.default_rng([seed, number])
    older = bool(rng.random() < 0.6)
    if number % EVERY == EVERY - 1:
        kind = WHOLE[int(rng.choice(3, p=[0.5, 0.4, 0.1]))]
        name = str(rng.choice(WHOLE_NAMES))
        longest = {"register": 6.0, "simulate": 3.0}[name]  # s of processor time; later is after the end
        at = rng.uniform(1, 60) * MEGABYTE if kind.startswith("memory") else longest * np.sqrt(rng.random())
        return name, Fault(kind, float(at)), older
    name = names[number % len(names)]
    shares = {kind: share for kind, share in SHARES.items() if mounts or kind not in ("disk", "read-only")}
    kind = str(rng.choice(list(shares), p=np.array(list(shares.values())) / sum(shares.values())))
    return name, Fault(kind, float(_moment(kind, sizes[name], rng))), older


def _moment(kind: str, size: Size, rng: np.random.Generator) -> float:
    if kind in ("half", "large"):
        return int(np.exp(rng.uniform(np.log(64), np.log(size.largest))))
    if kind == "disk":
        return int(rng.uniform(0.1, 1.5) * size.total) + 16384 * (len(size.names) + 8)
    if kind == "memory":
        return int(rng.uniform(0.01, 3) * MEGABYTE)
    return int(rng.integers(1, size.events + 1))
