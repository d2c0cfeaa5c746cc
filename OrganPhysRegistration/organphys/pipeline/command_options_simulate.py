"""The options of ``organphys simulate`` and ``organphys export``. Standard library only."""

from __future__ import annotations

import argparse
from typing import Any

TISSUES = "generic, liver, spleen, kidney, pancreas, prostate, gallbladder"
INSTRUMENTS = ("large_needle_driver", "prograsp", "mega")
FORMATS = ("stl", "obj", "ply", "vtp", "vtu", "msh", "npz", "splat")


def add_simulate(commands: Any) -> None:
    """organphys simulate"""
    parser = commands.add_parser(
        "simulate",
        help="grasp a registered organ with a da Vinci instrument",
        description="Simulates a registered organ under a tool that follows a trajectory, and writes recording.npz, "
        "states.npz, forces.csv, summary.json and strip.png. Without --trajectory the tool grasps the middle of the "
        "seen side and lifts it; the far side is then held if no pins are given.",
    )
    parser.add_argument("asset", metavar="ASSET", help="organ.organphys of a registration")
    parser.add_argument("--out", required=True, metavar="DIR", help="folder for the results; made if it is missing")
    parser.add_argument("--trajectory", metavar="FILE", help="tool poses over time: .csv or .json")
    parser.add_argument("--instrument", choices=INSTRUMENTS, default=INSTRUMENTS[0], help=f"default: {INSTRUMENTS[0]}")
    parser.add_argument(
        "--trocar",
        metavar="X,Y,Z",
        help="where the instrument enters, CT RAS mm (default: beside the line of sight, in reach of the organ)",
    )
    _add_body(parser)
    parser.add_argument(
        "--gravity",
        metavar="X,Y,Z",
        help="direction of gravity in CT axes (RAS), 9.81 m/s^2; 0,-1,0 for a patient on the back (default: none "
        "beside what shaped the registered organ)",
    )
    parser.add_argument(
        "--detail", action="store_true", help="finer tissue round the tool: dimples and tents, at some cost of time"
    )
    parser.add_argument("--fps", type=float, default=60.0, metavar="N", help="steps per second (default: 60)")
    parser.add_argument("--splat", metavar="FILE", help="splat (.ply) that follows the organ, in the pictures too")
    _add_follow(parser)
    parser.add_argument(
        "--splat-frames", type=int, metavar="K", help="write every K-th frame of the splat as INRIA PLY (needs --splat)"
    )
    parser.add_argument(
        "--device",
        choices=("cpu", "cuda"),
        default="cpu",
        help="what moves the splat (needs --splat): cpu exactly; cuda by warp (extra 'gpu') on an NVIDIA GPU, within "
        "0.1 mm (default: cpu)",
    )
    parser.add_argument(
        "--video",
        nargs="?",
        const="webp",
        choices=("webp", "gif", "png", "mp4"),
        help="an animation: webp (default), gif, png, or mp4 where ffmpeg is installed",
    )
    parser.add_argument(
        "--renderer",
        choices=("software", "vtk"),
        default="software",
        help="what draws pictures and video: software (default, everywhere), or vtk off the screen where the system "
        "has OpenGL",
    )
    _add_quiet(parser)


def add_export(commands: Any) -> None:
    """organphys export"""
    parser = commands.add_parser(
        "export",
        help="hand the organ to other programs",
        description="Writes a registered organ, or a moment of its simulation: surface (stl, obj, ply, vtp), "
        "tetrahedra (vtu, msh; needs the extra 'tetrahedra'), the reduced model (npz), or the moved splat (splat, an "
        "INRIA PLY).",
    )
    parser.add_argument("asset", metavar="ASSET", help="organ.organphys of a registration")
    parser.add_argument("--format", required=True, choices=FORMATS, help="what to write")
    parser.add_argument("--out", required=True, metavar="FILE", help="file; with --at all a folder")
    parser.add_argument(
        "--frame",
        choices=("scene", "ct", "m"),
        default="scene",
        help="axes and unit of stl, obj, ply, vtp, vtu, msh: scene units (default), CT RAS mm, or metres along the "
        "scene's axes",
    )
    parser.add_argument("--recording", metavar="FILE", help="recording.npz of a simulation of this organ")
    parser.add_argument("--at", metavar="T", help="moment of the recording in s (default: its end); all: every step")
    parser.add_argument("--splat", metavar="FILE", help="splat: source of the vertex colours, or what is moved")
    _add_follow(parser)
    parser.add_argument("--edge-mm", type=float, default=12.0, metavar="L", help="edge of the tetrahedra (default: 12)")
    _add_body(parser, only="only for npz: ")
    _add_quiet(parser)


def _add_body(parser: argparse.ArgumentParser, only: str = "") -> None:
    parser.add_argument(
        "--pins",
        metavar="FILE|X,Y,Z;...",
        help=f"{only}where the organ is held: Slicer .mrk.json, .fcsv or RAS mm; a description r=12 gives a radius",
    )
    parser.add_argument(
        "--pin-radius-mm", type=float, default=10.0, metavar="R", help="of the other pins (default: 10)"
    )
    parser.add_argument("--tissue", metavar="NAME", help=f"{only}{TISSUES} (default: by the organ's name)")
    parser.add_argument("--handles", type=int, default=20, metavar="H", help="of the reduced basis (default: 20)")
    parser.add_argument("--quadrature", type=int, default=1000, metavar="Q", help="points (default: 1000)")


def _add_follow(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--follow-mm",
        type=float,
        default=3.0,
        metavar="D",
        help="Gaussians within D mm of the organ follow it, those within 3 mm more less and less, the rest stays "
        "(default: 3)",
    )


def _add_quiet(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--quiet", action="store_true", help="no progress and no summary; errors are still printed")
