"""The readers under test: how each is called, and how what it returns is judged."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from oracle_archive import cloud_problem, organ_problem, recording_problem, sequence_problem
from oracle_ply import splat_problem
from oracle_table import TIMES, cases_problem, frames_problem, outcome_problem, times_problem
from oracle_text import landmarks_problem, pins_problem, points_problem, region_problem, trajectory_problem
from oracle_volume import labels_problem

from organphys.asset.asset_file import load_asset
from organphys.asset.sequence_file import load_sequence
from organphys.exports.recording_file import load_recording
from organphys.ground.checks import InputError
from organphys.pipeline.batch_table import read_batch
from organphys.pipeline.case_file import load_case
from organphys.pipeline.outcome_files import OUTCOME, load_outcome
from organphys.pipeline.points_file import read_points
from organphys.pipeline.sequence_inputs import frame_times, splat_files
from organphys.readers.gaussian_ply import describe_splat, read_gaussians, read_splat
from organphys.readers.landmarks_file import read_landmarks
from organphys.readers.pins_file import read_pins
from organphys.readers.roi_file import read_box
from organphys.readers.segmentation_file import describe_segmentation, read_organ
from organphys.readers.trajectory_file import read_trajectory

MEGABYTE = 1 << 20


@dataclass(frozen=True)
class Target:
    """read(path) is tried; problem(name, content, result) says what is wrong with a success, None if nothing.

    honest: memory that an intact file takes, in bytes per byte of its content once unpacked, as measured on files of
    2 to 20 MB (a label map's is that of surface and voxel centres, a text's that of Python's numbers, in the
    shortest rows, and so is that of an archive, which may be JSON for the most part).
    """

    read: Callable[[Path], Any]
    problem: Callable[[str, bytes, Any], str | None]
    honest: float


def _splat(path: Path) -> Any:
    cloud, gaussians = read_splat(path), read_gaussians(path)
    describe_splat(path)
    return cloud, gaussians


def _labels(path: Path) -> Any:
    """The description, and for one file in three the organ of its first label."""
    info = describe_segmentation(path)
    if info.layers == 1 and info.labels and path.stat().st_size % 3 == 0:
        try:
            organ = read_organ(path, organ=info.labels[0].label)
        except InputError as error:
            if str(error).startswith(str(path)):
                raise
            return info, None  # too few voxels for a surface
        return info, organ
    return info, None


def _labels_problem(name: str, content: bytes, result: Any) -> str | None:
    info, organ = result
    if organ is not None:
        if not all(np.isfinite(part).all() for part in (organ.vertices, organ.vertex_normals, organ.volume_points)):
            return "an organ of numbers that are not finite"
        if not 0 < organ.volume_ml <= sum(label.volume_ml for label in info.labels) * (1 + 1e-9):
            return f"an organ of {organ.volume_ml} ml"
    return labels_problem(name, content, info)


def _case_problem(name: str, content: bytes, session: Any) -> str | None:
    case = session.state.case
    if not np.isfinite(case.organ.vertices).all() or not case.organ.volume_ml > 0:
        return "organ"
    return cloud_problem(case.splat)


def _outcome(path: Path) -> Any:
    """Under the one name that is read."""
    place = path.with_name(OUTCOME)
    path.rename(place)
    try:
        return load_outcome(place.parent)
    finally:
        place.rename(path)


TARGETS = {
    "splat": Target(_splat, lambda name, content, got: splat_problem(content, *got), 3.0),
    "labels": Target(_labels, _labels_problem, 32.0),
    "landmarks": Target(read_landmarks, landmarks_problem, 12.0),
    "pins": Target(read_pins, pins_problem, 12.0),
    "region": Target(read_box, lambda name, content, got: region_problem(content, got), 12.0),
    "trajectory": Target(read_trajectory, trajectory_problem, 27.0),
    "points": Target(read_points, lambda name, content, got: points_problem(got), 36.0),
    "asset": Target(load_asset, lambda name, content, got: organ_problem(got), 12.0),
    "sequence": Target(load_sequence, lambda name, content, got: sequence_problem(got), 12.0),
    "recording": Target(load_recording, lambda name, content, got: recording_problem(got), 12.0),
    "case": Target(load_case, _case_problem, 32.0),
    "outcome": Target(_outcome, lambda name, content, got: outcome_problem(got), 12.0),
    "times": Target(
        lambda path: frame_times(TIMES, file=str(path))[0], lambda name, content, got: times_problem(content, got), 36.0
    ),
    "frames": Target(
        lambda path: splat_files(str(path)), lambda name, content, got: frames_problem(content, got), 80.0
    ),
    "cases": Target(read_batch, lambda name, content, got: cases_problem(content, got), 100.0),
}
