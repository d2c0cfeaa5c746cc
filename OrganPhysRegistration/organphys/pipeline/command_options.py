"""The options of each command, with their help. Standard library only, so that ``--help`` answers at once."""

from __future__ import annotations

import argparse
from typing import Any

SCHEMES = (
    "totalsegmentator, totalsegmentator-mr, totalsegmentator-v1, auto3dseg, btcv, amos, flare, word, kits, msd-liver, "
    "msd-pancreas, msd-spleen, msd-prostate"
)


def add_register(commands: Any) -> None:
    """organphys register"""
    parser = commands.add_parser(
        "register",
        help="register an organ onto a splat",
        description="Registers one organ of a label map onto a Gaussian splat and writes the asset (organ.organphys), "
        "registration.json, surface.vtp and report.html.",
    )
    _add_inputs(parser.add_argument_group("input"))
    _add_scene(parser.add_argument_group("scene"))
    _add_method(parser.add_argument_group("method"))
    parser.add_argument("--out", required=True, metavar="DIR", help="folder for the results; made if it is missing")
    _add_quiet(parser)


def _add_inputs(group: Any, *, splat: bool = True) -> None:
    group.add_argument("--labels", required=True, metavar="FILE", help="label map: .nii.gz, .nrrd, .seg.nrrd or .mha")
    group.add_argument(
        "--organ",
        required=True,
        metavar="NAME|ID",
        help="label number, or the organ's name if the file carries names or --label-scheme is given",
    )
    group.add_argument(
        "--label-scheme", metavar="NAME", help=f"table that gives the label numbers their names: {SCHEMES}"
    )
    if splat:
        text = "Gaussian splat or coloured point cloud (.ply)"
        group.add_argument("--splat", required=True, metavar="FILE", help=text)
    group.add_argument(
        "--landmarks",
        metavar="FILE|X,Y,Z;...",
        help="one or two points on the seen part of the CT organ: Slicer .mrk.json, .fcsv, or coordinates in RAS mm "
        '("x,y,z;x,y,z"); the default method works without',
    )
    group.add_argument(
        "--splat-landmarks",
        metavar="FILE|X,Y,Z;...",
        help="the same points on the splat, in raw scene units; matched to --landmarks by label, else by order",
    )
    group.add_argument("--no-opening", action="store_true", help="leave out the opening that removes thin spurs")
    group.add_argument("--close-holes", action="store_true", help="fill holes inside the organ")


def _add_scene(group: Any) -> None:
    group.add_argument(
        "--roi", metavar="FILE", help='crop box of the splat: Slicer ROI .mrk.json or JSON {"center","size","axes"}'
    )
    group.add_argument(
        "--camera",
        nargs=3,
        type=float,
        default=[0.0, 0.0, 0.0],
        metavar=("X", "Y", "Z"),
        help="position of the endoscope camera in scene units (default: 0 0 0)",
    )
    group.add_argument(
        "--fov", type=float, metavar="DEG", help="full field of view in degrees (default: from the splat)"
    )
    group.add_argument(
        "--mm-per-unit",
        metavar="S|S:P",
        help="millimetres per scene unit: S exact, S:P with a standard deviation of P percent (default: unknown)",
    )
    group.add_argument(
        "--opacity",
        type=float,
        default=0.1,
        metavar="A",
        help="Gaussians below this opacity are left out (default: 0.1)",
    )
    group.add_argument(
        "--clean", action="store_true", help="remove outliers and small clusters from the splat, and report how many"
    )


def _add_method(group: Any) -> None:
    group.add_argument(
        "--method",
        choices=("organphys", "paper"),
        default="organphys",
        help="organphys: visible side, joint scale, landmarks optional (default); paper: the method of the OrganPhys "
        "paper, needs landmarks",
    )
    group.add_argument(
        "--stiffness",
        choices=("conservative", "moderate", "aggressive"),
        default="moderate",
        help="how far the organ may deform: the last level of the annealing (default: moderate)",
    )
    group.add_argument(
        "--weights",
        choices=("rkpm", "learned"),
        default="rkpm",
        help="skinning weights of the paper method; learned needs torch (default: rkpm)",
    )
    group.add_argument("--seed", type=int, default=0, metavar="N", help="seed of all random choices (default: 0)")


def add_map(commands: Any) -> None:
    """organphys map"""
    parser = commands.add_parser(
        "map",
        help="map points with a registered organ",
        description="Maps points from CT (RAS mm) to the scene (raw units of the splat), or back with --inverse. "
        "Needs nothing but the asset.",
    )
    parser.add_argument(
        "asset", metavar="ASSET", help="organ.organphys of a registration, or organ.organphys-seq of a sequence"
    )
    parser.add_argument("--frame", type=int, metavar="K", help="frame of a sequence, the first is 0")
    parser.add_argument(
        "--points",
        required=True,
        metavar="FILE",
        help="points (N, 3): .npy, or .csv with x,y,z (a header may name them)",
    )
    parser.add_argument("--out", required=True, metavar="FILE", help="mapped points (N, 3), .npy, same order")
    parser.add_argument("--inverse", action="store_true", help="from the scene to CT")
    parser.add_argument(
        "--confidence",
        action="store_true",
        help="two more columns: the radius in mm within which the true position lies with 68 %% and with 95 %% "
        "probability; the file is then (N, 5)",
    )
    _add_quiet(parser)


def add_info(commands: Any) -> None:
    """organphys info"""
    parser = commands.add_parser(
        "info",
        help="say what is in a file",
        description="Says what is in a label map (labels, volumes), a splat (layout, counts, extent) or an asset.",
    )
    parser.add_argument("file", metavar="FILE", help="label map, splat (.ply) or asset (.organphys)")
    parser.add_argument("--label-scheme", metavar="NAME", help=f"names for the labels of a label map: {SCHEMES}")


def add_demo(commands: Any) -> None:
    """organphys demo"""
    parser = commands.add_parser(
        "demo",
        help="make a sample case, register it and show the errors",
        description="Builds a sample case with known truth (an organ-like shape, deformed, seen by a camera, turned "
        "into a noisy partial splat), registers it and prints how far off each stage is.",
    )
    parser.add_argument(
        "--out", default="organphys-demo", metavar="DIR", help="folder for case and results (default: organphys-demo)"
    )
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="another seed, another case (default: 0)")
    parser.add_argument("--size", choices=("full", "small"), default="full", help=argparse.SUPPRESS)
    _add_quiet(parser)


def _add_quiet(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--quiet", action="store_true", help="no progress and no summary; errors are still printed")
