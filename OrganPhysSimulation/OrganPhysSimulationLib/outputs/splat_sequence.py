"""The splat at every recorded step as a folder of files, written beside Slicer's window."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from organphys.exports.splat_frames import FollowingSplat
from organphys.ground.checks import InputError
from organphys.ground.progress import Cancelled
from organphys.pipeline.recorded_splat import frame_count, write_splat_frames
from organphys.simulation.blas_threads import one_blas_thread
from organphys.simulation.session import Recording

from ..engine.live_simulation import LiveSimulation
from ..inputs.splat_input import SplatFile, file_of
from .export import recorded


@dataclass
class SplatSequence:
    """All that is written, free of nodes. ``fraction``: of the frames, written so far; ``cancelled``: stop soon."""

    recording: Recording
    splat: SplatFile
    unit: float
    folder: Path
    fraction: float = 0.0
    cancelled: bool = False

    @property
    def frames(self) -> int:
        """The start and one per step."""
        return frame_count(self.recording)

    @one_blas_thread
    def write(self) -> str:
        """The folder, with all frames in it. No scene, no Qt: may run on another thread, for minutes.

        The steps are computed again. Cancelled: it was, and nothing was written.
        """
        body = self.recording.start.scene.bodies[0]
        splat = FollowingSplat(self.splat.read(), body, self.unit)
        write_splat_frames(self.folder, self.recording, splat, progress=self._told)
        return str(self.folder)

    def _told(self, stage: str, fraction: float) -> None:
        if self.cancelled:
            raise Cancelled
        self.fraction = fraction


def splat_sequence(live: LiveSimulation, splat: Any, folder: str | os.PathLike[str]) -> SplatSequence:
    """What ``folder`` will get. InputError: no splat follows, its file is not known, nothing was simulated."""
    if splat is None:
        raise InputError("splat: the simulation runs without one; choose a splat and prepare again")
    return SplatSequence(recorded(live), file_of(splat), live.prepared.unit, Path(folder))
