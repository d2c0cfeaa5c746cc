"""What a method hands back, the same for all, so that all are scored alike."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from time import perf_counter, process_time
from typing import Any

from organphys.ground.checks import Array
from organphys.ground.frames import Similarity


@dataclass(frozen=True)
class Outcome:
    """map_points: CT points (N, 3) in RAS mm, on the organ or in it, to the scene (N, 3).

    T_scene_ct: the similarity beyond which the organ is deformed; extension: how points inside are mapped where the
    method itself moves surface points only; stages: T_scene_ct at the end of earlier stages, by name; facts: numbers of
    the method's own, JSON values.
    """

    map_points: Callable[[Array], Array]
    T_scene_ct: Similarity
    extension: str = ""
    stages: Mapping[str, Similarity] = field(default_factory=dict)
    facts: Mapping[str, Any] = field(default_factory=dict)


@dataclass
class Clock:
    """Wall and processor seconds by stage."""

    stages: dict[str, dict[str, float]] = field(default_factory=dict)

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Add the time that the block takes to stage ``name``."""
        wall, processor = perf_counter(), process_time()
        try:
            yield
        finally:
            spent = self.stages.setdefault(name, {"wall_s": 0.0, "processor_s": 0.0})
            spent["wall_s"] += perf_counter() - wall
            spent["processor_s"] += process_time() - processor
