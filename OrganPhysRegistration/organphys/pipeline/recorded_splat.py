"""The splat at every step of a recording, as a folder of PLY files with stable rows."""

from __future__ import annotations

import os
from pathlib import Path

from ..exports.splat_frames import FollowingSplat, frame_name
from ..ground.checks import InputError
from ..ground.progress import Progress, no_progress
from ..simulation.session import Move, Recording
from .output_folder import whole_or_nothing
from .recorded_moment import moments


def frame_count(recording: Recording) -> int:
    """Frames of a recording: the start and one per step."""
    return 1 + sum(isinstance(event, Move) for event in recording.events)


def write_splat_frames(
    out: str | os.PathLike[str], recording: Recording, splat: FollowingSplat, *, progress: Progress = no_progress
) -> int:
    """All frames, splat_00000.ply and so on, into a folder that gets all of them or none; how many they are.

    InputError: the folder cannot be written to, or holds later frames of a longer sequence, which would play on.
    """
    count, frames = 0, frame_count(recording)
    for later in sorted(Path(out).glob("splat_[0-9]*.ply")):
        if later >= frame_name(out, frames):
            raise InputError(
                f"{out}: holds frames of a longer sequence ({later.name}); name another folder, or delete them"
            )
    with whole_or_nothing(Path(out)) as folder:
        for count, moment in enumerate(moments(recording)):
            progress("write the frames", count / frames)
            splat.write(frame_name(folder, count), moment)
    return count + 1
