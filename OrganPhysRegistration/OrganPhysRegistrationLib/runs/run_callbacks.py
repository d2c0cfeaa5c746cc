"""Whom a run tells what."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


def nothing(*arguments: Any) -> None:
    """Does nothing."""


@dataclass(frozen=True)
class RunCallbacks:
    """All are called on the main thread, from the event loop.

    progress(stage, fraction): fraction (0..1) of the whole run. surface(points (Nv, 3)): vertices in scene units, after
    each stage on the way and while the elastic one runs. done(case): surfaces and tables stand in the scene.
    transform(case): its transforms are elastic now. failed(code, message) ends a run that is not done: "input",
    "cancelled", "closed" (the scene), "internal", the scene is as before the run; or "transform": after ``done``, the
    surfaces stand but not the elastic transforms.
    """

    progress: Callable[[str, float], None] = nothing
    surface: Callable[[Any], None] = nothing
    done: Callable[[Any], None] = nothing
    transform: Callable[[Any], None] = nothing
    failed: Callable[[str, str], None] = nothing
