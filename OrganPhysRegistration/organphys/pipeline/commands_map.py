"""organphys map: points through a registered organ, from the asset alone."""

from __future__ import annotations

import argparse
import sys

import numpy as np

from ..asset.asset_file import load_asset
from ..asset.registered_organ import RegisteredOrgan
from ..asset.sequence_file import ENDING, load_sequence
from ..basis.error_radius import error_radius
from ..ground.atomic_file import atomic_path
from ..ground.checks import Array, InputError
from .points_file import read_points


def run(arguments: argparse.Namespace) -> None:
    """The command with its parsed options; InputError for what cannot be used."""
    if not arguments.out.lower().endswith(".npy"):
        raise InputError(f"--out: expected a file that ends in .npy, got {arguments.out}")
    points = read_points(arguments.points)
    organ = organ_of(arguments.asset, arguments.frame)
    mapped = organ.inverse_map_points(points) if arguments.inverse else organ.map_points(points)
    if arguments.confidence:
        mapped = np.column_stack([mapped, error_radii(organ, mapped if arguments.inverse else points)])
    with atomic_path(arguments.out) as temporary, open(temporary, "wb") as file:
        np.save(file, mapped, allow_pickle=False)
    if arguments.quiet:
        return
    positions = mapped[:, :3]
    lost = ~np.isfinite(positions).all(axis=1)
    if lost.any():
        print(f"organphys: warning: {int(lost.sum())} points have no inverse and are NaN", file=sys.stderr)
    source, target = ("scene units", "CT, RAS mm") if arguments.inverse else ("CT, RAS mm", "scene units")
    at = positions if arguments.inverse else points
    distance = organ.outside_distance_mm(at[np.isfinite(at).all(axis=1)])
    print(f"{len(points)} points, {source} -> {target}: {arguments.out}")
    if (distance > 0).any():
        print(f"{int((distance > 0).sum())} of them lie outside the organ, up to {distance.max():.1f} mm")
    if arguments.confidence and len(points):
        middle = np.nanmedian(mapped[:, 3:], axis=0)
        print(f"median error radius {middle[0]:.2f} mm (68 %), {middle[1]:.2f} mm (95 %)")


def organ_of(path: str, frame: int | None) -> RegisteredOrgan:
    """The organ of an asset, or of a sequence at ``frame``."""
    if not path.lower().endswith(ENDING):
        if frame is not None:
            raise InputError(f"--frame: {path} is no sequence; leave it out, or name a file that ends in {ENDING}")
        return load_asset(path)
    sequence = load_sequence(path)
    if frame is None:
        raise InputError(f"{path}: a sequence of {len(sequence)} frames; say which one with --frame")
    return sequence.frame(frame)


def error_radii(organ: RegisteredOrgan, points_ct: Array) -> Array:
    """Radii (N, 2) in mm that hold the true positions of CT points (N, 3) with 68 % and with 95 % probability.

    Back from the scene they are the radii about the CT points, the similarity's scale taken out; NaN where a point has
    no inverse.
    """
    radii, known = np.full((len(points_ct), 2), np.nan), np.isfinite(points_ct).all(axis=1)
    covariance = organ.covariance(points_ct[known])
    for column, probability in enumerate((0.68, 0.95)):
        radii[known, column] = error_radius(covariance, probability, freedom=organ.known_uncertainty.freedom)
    return radii
