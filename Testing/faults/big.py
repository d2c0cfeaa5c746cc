"""A CT of 512 x 512 x 1500 voxels and a splat of 3,000,000 Gaussians, registered in a process of its own."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import SimpleITK

from organphys.exports.sample_files import write_splat

SIZE, SPACING = (512, 512, 1500), 0.8  # voxels i, j, k; mm
AXES = np.array([90.0, 70.0, 60.0])  # of an ellipsoid in the middle, mm
GAUSSIANS, PER_MM, AWAY = 3_000_000, 0.01, 3.0  # scene units a mm; scene units from the camera


def run_big(state: dict) -> None:
    """Put what came out into ``state``, once."""
    if state["big"]:
        return
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        _write(folder)
        command = [sys.executable, "-m", "organphys", "register", "--labels", str(folder / "labels.nii")]
        command += ["--organ", "5", "--splat", str(folder / "splat.ply"), "--quiet", "--out", str(folder / "out")]
        child = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
        _, status, used = os.wait4(child.pid, 0)
        code, said = os.waitstatus_to_exitcode(status), child.stderr.read() if child.stderr else ""
        what = f"{' x '.join(map(str, SIZE))} voxels of one byte, {GAUSSIANS:,} Gaussians"
        spent = f"{used.ru_utime + used.ru_stime:.0f} s of processor time, {used.ru_maxrss / 1024:.0f} MB at most"
        ended = _told(folder / "out") if code == 0 else f"exit code {code}, {said.strip()[-200:]}"
    state["big"] = {"CT and splat": f"{what}: {spent}; {ended}"}


def _told(out: Path) -> str:
    record = json.loads((out / "registration.json").read_text())
    fit = record["metrics"]["elastic"]["trim30_splat_to_ct"]
    return f"registered, splat to organ {fit['value']:.2f} {fit['unit']}, verdict {record['verdict']['level']}"


def _write(folder: Path) -> None:
    voxels = np.zeros(SIZE[::-1], dtype=np.uint8)
    middle = (np.array(SIZE) - 1) / 2
    low, high = (np.rint(middle + sign * (AXES / SPACING + 2)).astype(int) for sign in (-1, 1))
    k, j, i = np.ogrid[low[2] : high[2], low[1] : high[1], low[0] : high[0]]
    part = sum(
        np.square(SPACING * (index - centre) / axis)
        for index, centre, axis in zip((i, j, k), middle, AXES, strict=True)
    )
    voxels[low[2] : high[2], low[1] : high[1], low[0] : high[0]][part < 1] = 5
    image = SimpleITK.GetImageFromArray(voxels)
    image.SetSpacing([SPACING] * 3)
    SimpleITK.WriteImage(image, str(folder / "labels.nii"))
    rng = np.random.default_rng(0)
    directions = rng.normal(size=(GAUSSIANS, 3))
    directions[:, 2] = -np.abs(directions[:, 2])  # the side that faces the camera
    points = AXES * directions / np.linalg.norm(directions, axis=1, keepdims=True) + rng.normal(
        scale=0.3, size=(GAUSSIANS, 3)
    )
    centres = PER_MM * points + [0, 0, AWAY]
    turns = np.tile(np.array([1.0, 0, 0, 0]), (GAUSSIANS, 1))
    grey = np.full((GAUSSIANS, 3), 0.5)
    write_splat(folder / "splat.ply", centres, np.full((GAUSSIANS, 3), 0.004), turns, grey, np.full(GAUSSIANS, 0.9))
