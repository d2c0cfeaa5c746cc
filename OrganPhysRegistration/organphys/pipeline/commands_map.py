"""organphys map: points through a registered organ, from the asset alone."""

from __future__ import annotations

import argparse
import sys

import numpy as np

from ..asset.asset_file import load_asset
from ..ground.atomic_file import atomic_path
from ..ground.checks import InputError
from .points_file import read_points


def run(arguments: argparse.Namespace) -> None:
    """The command with its parsed options; InputError for what cannot be used."""
    if not arguments.out.lower().endswith(".npy"):
        raise InputError(f"--out: expected a file that ends in .npy, got {arguments.out}")
    points = read_points(arguments.points)
    organ = load_asset(arguments.asset)
    mapped = organ.inverse_map_points(points) if arguments.inverse else organ.map_points(points)
    with atomic_path(arguments.out) as temporary, open(temporary, "wb") as file:
        np.save(file, mapped, allow_pickle=False)
    if arguments.quiet:
        return
    lost = ~np.isfinite(mapped).all(axis=1)
    if lost.any():
        print(f"organphys: warning: {int(lost.sum())} points have no inverse and are NaN", file=sys.stderr)
    source, target = ("scene units", "CT, RAS mm") if arguments.inverse else ("CT, RAS mm", "scene units")
    at = mapped if arguments.inverse else points
    distance = organ.outside_distance_mm(at[np.isfinite(at).all(axis=1)])
    print(f"{len(points)} points, {source} -> {target}: {arguments.out}")
    if (distance > 0).any():
        print(f"{int((distance > 0).sum())} of them lie outside the organ, up to {distance.max():.1f} mm")
