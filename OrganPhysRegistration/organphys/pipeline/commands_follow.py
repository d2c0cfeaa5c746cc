"""organphys follow: a sequence of splats in, one file with the organ at every time and a report out."""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..asset.organ_sequence import OrganSequence
from ..asset.sequence_file import ENDING, save_sequence
from ..exports.sequence_report import SeenFrame, write_sequence_report
from ..ground.atomic_file import write_text
from ..ground.plain_json import dump
from ..points.point_sets import Camera, GaussianCloud
from ..points.sampling import random_subset
from ..readers.gaussian_ply import read_splat
from ..readers.roi_file import read_box
from ..readers.segmentation_file import read_organ
from .commands_register import landmarks_of, opacity_of, unit_of
from .output_folder import whole_or_nothing
from .registration import RegisterOptions
from .sequence import SequenceFollower
from .sequence_inputs import frame_times, splat_files
from .terminal_progress import shown_progress
from .tracking import FollowOptions

SEQUENCE, JSON, REPORT = f"organ{ENDING}", "sequence.json", "report.html"
PICTURES, PICTURE_POINTS = 9, 40_000


def run(arguments: argparse.Namespace) -> None:
    """The command with its parsed options; InputError for what cannot be used."""
    with shown_progress(quiet=arguments.quiet) as progress, whole_or_nothing(arguments.out) as stage:
        files = splat_files(arguments.splats)
        times, unit = frame_times(len(files), fps=arguments.fps, file=arguments.times)
        follower = follower_of(arguments, files)
        shown = set(np.linspace(0, len(files) - 1, min(PICTURES, len(files))).round().astype(int).tolist())
        seen, read = [], np.zeros(len(files))
        for k, (file, at) in enumerate(zip(files, times, strict=True)):
            begin = time.perf_counter()
            splat = read_splat(file)
            read[k] = time.perf_counter() - begin
            follower.add(splat, float(at))
            progress("follow", (k + 1) / len(files))
            if k in shown:
                seen.append(_picture_of(k, splat, arguments.opacity))
        sequence = follower.sequence_with(time_unit=unit, figures={"read_seconds": read})
        save_sequence(sequence, stage / SEQUENCE)
        write_text(stage / JSON, dump(_facts(sequence, files)))
        facts = {**sequence.organ.provenance, "splats": [file.name for file in files]}
        write_sequence_report(stage / REPORT, sequence, seen, follower.camera.position, facts)
    if not arguments.quiet:
        print(summary(sequence, arguments.out))


def follower_of(arguments: argparse.Namespace, files: list[Path]) -> SequenceFollower:
    """What the options ask for; the small inputs are read first, their errors are found at once."""
    options = RegisterOptions(
        stiffness=arguments.stiffness,
        seed=arguments.seed,
        opacity=opacity_of(arguments.opacity),
        clean=arguments.clean,
    )
    damping = {} if arguments.damping is None else {"damping": arguments.damping}
    follow = FollowOptions(scale_percent=arguments.scale_percent, restart=not arguments.no_restart, **damping)
    camera, unit = Camera(arguments.camera, arguments.fov), unit_of(arguments.mm_per_unit)
    landmarks = landmarks_of(arguments.landmarks, arguments.splat_landmarks)
    box = None if arguments.roi is None else read_box(arguments.roi)
    organ = read_organ(
        arguments.labels,
        organ=arguments.organ,
        label_scheme=arguments.label_scheme,
        opening=not arguments.no_opening,
        close_holes=arguments.close_holes,
    )
    provenance = {"organphys": __version__, "first_splat": files[0].name, "frames": len(files)}
    return SequenceFollower(
        organ, options, follow=follow, landmarks=landmarks, camera=camera, box=box, unit=unit, provenance=provenance
    )


def _picture_of(frame: int, splat: GaussianCloud, opacity: float) -> SeenFrame:
    shown = np.flatnonzero(splat.valid & (splat.opacities > opacity))
    shown = shown[random_subset(len(shown), PICTURE_POINTS, 0)]
    return SeenFrame(frame, splat.centres[shown].astype(np.float64), splat.colours[shown].astype(np.float64))


def _facts(sequence: OrganSequence, files: list[Path]) -> dict[str, Any]:
    figures = {name: values.tolist() for name, values in sequence.figures.items()}
    return {
        "organphys": __version__,
        "time_unit": sequence.time_unit,
        "frames": [
            {"frame": k, "splat": file.name, "time": float(sequence.times[k]), "status": sequence.status[k]}
            | {name: values[k] for name, values in figures.items()}
            | {"T_scene_ct": sequence.similarity(k).matrix.tolist()}
            for k, file in enumerate(files)
        ],
        "notices": [{"frame": frame, "message": message} for frame, message in sequence.notices],
    }


def summary(sequence: OrganSequence, folder: str) -> str:
    """What the command prints."""
    distance, seconds = sequence.figures["splat_to_organ_trim30_mm"], sequence.figures["seconds"]
    lines = [
        f"{len(sequence)} frames, splat to organ (mean of the nearest 70 %): median {np.median(distance):.2f} mm, "
        f"worst {distance.max():.2f} mm",
        f"first frame {seconds[0]:.1f} s, further frames median {np.median(seconds[1:]):.2f} s",
    ]
    lines += [f"warning: frame {frame}: {message}" for frame, message in sequence.notices]
    return "\n".join([*lines, f"report: {Path(folder) / REPORT}"])
