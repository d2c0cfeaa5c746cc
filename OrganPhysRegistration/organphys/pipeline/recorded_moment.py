"""One moment of a recording, for the organ it was made of."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..asset.registered_organ import RegisteredOrgan
from ..exports.recording_file import load_recording
from ..ground.checks import InputError
from ..ground.progress import Progress, no_progress
from ..simulation.organ_body import metres_per_unit
from ..simulation.session import Move, PinEdit, Recording, Simulation, Snapshot

NEAR_M = 1e-6


def recording_of(path: str, organ: RegisteredOrgan) -> tuple[Recording, int]:
    """The recording and the number of the organ's body in it; InputError if it is of another organ."""
    recording, own = load_recording(path), organ.scene_vertices * metres_per_unit(organ)
    for index, body in enumerate(recording.start.scene.bodies):
        vertices = body.samples.vertices
        if vertices.shape == own.shape and np.abs(vertices - own).max() < NEAR_M:
            return recording, index
    raise InputError(f"{path}: recording of another organ than {organ.name!r}; name the asset that was simulated")


def moments(recording: Recording) -> Iterator[Snapshot]:
    """The start and the moment after every step, computed again one by one."""
    simulation = Simulation(*recording.start, detail=recording.detail)
    yield simulation.snapshot
    for event in recording.events:
        if isinstance(event, Move):
            simulation.step(event.poses, dt=event.dt)
            yield simulation.snapshot
        elif isinstance(event, PinEdit):
            simulation.set_pins(event.body, *event.pins)
        else:
            simulation.set_options(event)


def moment_at(recording: Recording, time: float | None, *, progress: Progress = no_progress) -> Snapshot:
    """The first moment at or after ``time`` s, the last one for None; InputError for a time outside the recording."""
    steps = [event.dt for event in recording.events if isinstance(event, Move)]
    first = recording.start.state.time
    end = first + sum(steps)
    if time is not None and not first <= time <= end + 1e-9:
        raise InputError(f"--at: the recording goes from {first:g} s to {end:g} s, got {time:g}")
    now = recording.start
    for count, now in enumerate(moments(recording)):
        progress("replay", count / max(len(steps), 1))
        if time is not None and now.state.time >= time - 1e-9:
            break
    return now
