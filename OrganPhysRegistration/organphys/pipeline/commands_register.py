"""organphys register: files in, a folder with the registered organ and its report out."""

from __future__ import annotations

import argparse
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ..ground.checks import InputError
from ..ground.progress import Progress
from ..points.point_sets import Box, Camera, Landmarks, SceneUnit
from ..readers.gaussian_ply import read_splat
from ..readers.landmark_pairs import read_landmark_pairs
from ..readers.landmarks_file import read_landmarks
from ..readers.roi_file import read_box
from ..readers.segmentation_file import read_organ
from .output_folder import whole_or_nothing
from .provenance import provenance_of
from .register import register
from .registration import RegisterOptions, Registration
from .terminal_progress import shown_progress
from .write_outputs import write_outputs


def run(arguments: argparse.Namespace) -> None:
    """The command with its parsed options; InputError for what cannot be used."""
    with shown_progress(quiet=arguments.quiet) as progress, whole_or_nothing(arguments.out) as stage:
        registration = register_files(arguments, progress)
        write_outputs(registration, stage)
    if not arguments.quiet:
        print(summary(registration, arguments.out))


def register_files(arguments: argparse.Namespace, progress: Progress) -> Registration:
    """Read what the options name and register it. The small files come first: their errors are found at once."""
    begin = time.perf_counter()
    small = small_inputs(arguments)
    splat = read_splat(arguments.splat, progress=progress)
    organ = read_organ(
        arguments.labels,
        organ=arguments.organ,
        label_scheme=arguments.label_scheme,
        opening=not arguments.no_opening,
        close_holes=arguments.close_holes,
        progress=progress,
    )
    provenance = provenance_of(arguments)
    read_seconds = time.perf_counter() - begin
    registration = register(
        organ,
        splat,
        small.options,
        landmarks=small.landmarks,
        camera=small.camera,
        box=small.box,
        unit=small.unit,
        provenance=provenance,
        progress=progress,
    )
    return replace(registration, seconds={"read": read_seconds, **registration.seconds})


@dataclass(frozen=True)
class SmallInputs:
    """What is asked for, but for label map and splat."""

    options: RegisterOptions
    camera: Camera
    unit: SceneUnit | None
    landmarks: Landmarks | None
    box: Box | None


def small_inputs(arguments: argparse.Namespace) -> SmallInputs:
    """Options, landmarks and crop box, read and checked; InputError tells which of them cannot be used."""
    options = RegisterOptions(
        method=arguments.method,
        stiffness=arguments.stiffness,
        seed=arguments.seed,
        opacity=opacity_of(arguments.opacity),
        weights=arguments.weights,
        clean=arguments.clean,
    )
    camera, unit = Camera(arguments.camera, arguments.fov), unit_of(arguments.mm_per_unit)
    if options.method == "paper" and arguments.landmarks is None:
        raise InputError("method paper needs landmarks: give --landmarks, or take --method organphys")
    landmarks = landmarks_of(arguments.landmarks, arguments.splat_landmarks)
    return SmallInputs(options, camera, unit, landmarks, None if arguments.roi is None else read_box(arguments.roi))


def landmarks_of(on_organ: str | None, on_splat: str | None) -> Landmarks | None:
    """The landmarks named by --landmarks and --splat-landmarks."""
    if on_organ is None:
        if on_splat is not None:
            raise InputError("--splat-landmarks: give the same points in the CT with --landmarks")
        return None
    return read_landmarks(on_organ) if on_splat is None else read_landmark_pairs(on_organ, on_splat)


def unit_of(text: str | None) -> SceneUnit | None:
    """``S`` or ``S:P`` as a scene unit."""
    if text is None:
        return None
    try:
        return SceneUnit(*(float(part) for part in text.split(":", 1)))
    except InputError:
        raise
    except ValueError as error:
        raise InputError(f"--mm-per-unit: expected S or S:P, say 25 or 25:5, got {text!r}") from error


def opacity_of(value: float) -> float:
    """A threshold within 0..1."""
    if not 0 <= value < 1:
        raise InputError(f"--opacity: expected a number from 0 to below 1, got {value}")
    return value


def summary(registration: Registration, folder: str | Path) -> str:
    """What the command prints: distances per stage, warnings, and where the results are."""
    lines = [
        "distance in mm, mean of the nearest 70 %:",
        f"{'stage':10s}{'splat to organ':>16s}{'organ to splat':>16s}",
    ]
    for stage, metrics in registration.metrics.items():
        values = [_value(metrics, name) for name in ("trim30_splat_to_ct", "trim30_ct_to_splat")]
        lines.append(f"{stage:10s}" + "".join(f"{value:>16s}" for value in values))
    verdict = registration.verdict
    if verdict is not None:
        lines += [f"verdict: {verdict.headline}", *(f"  - {reason.message}" for reason in verdict.reasons)]
    told = {reason.code for reason in verdict.reasons} if verdict is not None else set()
    lines += [f"warning: {notice.message}" for notice in registration.notices if notice.code not in told]
    lines.append(f"report: {Path(folder) / 'report.html'}")
    return "\n".join(lines)


def _value(metrics: Mapping[str, Mapping[str, Any]], name: str) -> str:
    entry = metrics.get(name)
    return "-" if entry is None else f"{entry['value']:.2f}"
