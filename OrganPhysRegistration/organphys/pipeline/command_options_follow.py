"""The options of organphys follow."""

from __future__ import annotations

from typing import Any

from .command_options import _add_inputs, _add_quiet, _add_scene


def add_follow(commands: Any) -> None:
    """organphys follow"""
    parser = commands.add_parser(
        "follow",
        help="follow an organ through a sequence of splats",
        description="Registers the first splat of a sequence in full and follows the organ through the others. Writes "
        "organ.organphys-seq (map points at any frame with organphys map), sequence.json and report.html.",
    )
    _add_inputs(parser.add_argument_group("input"), splat=False)
    group = parser.add_argument_group("sequence")
    group.add_argument(
        "--splats",
        required=True,
        metavar="FOLDER|PATTERN|LIST.txt",
        help="one .ply per time step: a folder, a pattern in quotes, or a text file with one path per line",
    )
    group.add_argument("--fps", type=float, metavar="F", help="splats per second (default: times are frame numbers)")
    group.add_argument("--times", metavar="FILE", help="text file with the time of each splat in seconds, one per line")
    group.add_argument(
        "--damping",
        type=float,
        metavar="D",
        help="how strongly bending is held back from frame to frame, no unit: 0 none; default: see the documentation "
        "of FollowOptions",
    )
    group.add_argument(
        "--scale-percent",
        type=float,
        default=0.0,
        metavar="P",
        help="standard deviation by which the scale may change from frame to frame (default 0: fixed by the first)",
    )
    group.add_argument("--no-restart", action="store_true", help="do not search again where the organ is lost")
    _add_scene(parser.add_argument_group("scene"))
    method = parser.add_argument_group("method")
    method.add_argument(
        "--stiffness", choices=("conservative", "moderate", "aggressive"), default="moderate", help="as of register"
    )
    method.add_argument("--seed", type=int, default=0, metavar="N", help="seed of all random choices (default: 0)")
    parser.add_argument("--out", required=True, metavar="DIR", help="folder for the results; made if it is missing")
    _add_quiet(parser)
