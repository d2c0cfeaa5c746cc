"""The request "follow" of the session server: the loaded case's organ through a sequence of splats.

The folder it leaves: organ.organphys-seq, sequence.json (times, time_unit, status, T_scene_ct per frame, notices),
faces.npy (F, 3) and frame_K.npy (V, 3), scene units: a thinned surface for playback.
"""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..asset.organ_sequence import OrganSequence
from ..asset.sequence_file import ENDING, save_sequence
from ..exports.mesh_thinning import thin_mesh
from ..ground.atomic_file import write_text
from ..ground.checks import InputError
from ..ground.plain_json import dump
from ..ground.progress import Progress
from ..readers.gaussian_ply import read_splat
from .case import Case
from .outer_loop import landmarks_at
from .sequence import SequenceFollower
from .sequence_inputs import frame_times, splat_files
from .session import RegistrationSession

SEQUENCE, FACTS, FACES = f"organ{ENDING}", "sequence.json", "faces.npy"


def follow_case(session: RegistrationSession, fields: Mapping[str, Any], folder: Path, progress: Progress) -> None:
    """Follow and write ``folder``; InputError for what cannot be used, nothing is left then."""
    source, fps = fields.get("splats"), fields.get("fps")
    if not isinstance(source, str) or not source:
        raise InputError("follow: name the folder, pattern or list of the splats")
    files = splat_files(source)
    times, unit = frame_times(len(files), fps=None if not fps else float(fps))
    follower, told = follower_of(session), _Within(progress)
    for k, (file, at) in enumerate(zip(files, times, strict=True)):
        told.share = (k / len(files), 1 / len(files))
        told("follow", 0.0)
        follower.add(read_splat(file), float(at), told)
    try:
        folder.mkdir(parents=True)
        _write(follower.sequence_with(time_unit=unit), folder)
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise


def follower_of(session: RegistrationSession) -> SequenceFollower:
    """With the inputs of a session."""
    case: Case = session.state.case
    landmarks = landmarks_at(case, case.landmarks) if len(case.landmarks) else None
    return SequenceFollower(
        case.organ, case.options, landmarks=landmarks, camera=case.camera, box=session.box, unit=case.unit,
        provenance=case.provenance,
    )  # fmt: skip


class _Within:
    """Progress of one frame as a part of the whole."""

    def __init__(self, progress: Progress) -> None:
        self.progress, self.share = progress, (0.0, 1.0)

    def __call__(self, stage: str, fraction: float) -> None:
        self.progress("follow", self.share[0] + self.share[1] * min(max(fraction, 0.0), 1.0))


def _write(sequence: OrganSequence, folder: Path) -> None:
    save_sequence(sequence, folder / SEQUENCE)
    thin = thin_mesh(sequence.organ.vertices, sequence.organ.faces)
    np.save(folder / FACES, thin.faces.astype(np.int32))
    for k in range(len(sequence)):
        np.save(folder / f"frame_{k}.npy", thin.averaged(sequence.scene_vertices(k)).astype(np.float32))
    facts = {
        "times": sequence.times,
        "time_unit": sequence.time_unit,
        "status": sequence.status,
        "T_scene_ct": [sequence.similarity(k).matrix for k in range(len(sequence))],
        "notices": [[frame, message] for frame, message in sequence.notices],
        "figures": dict(sequence.figures),
    }
    write_text(folder / FACTS, dump(facts))
