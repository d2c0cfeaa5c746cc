"""The largest case of the scaling benchmark through the command line, as a user runs it."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

from measured import when
from scaling_case import sample_splat, write_labels_of, write_splat_of

VOXELS, GAUSSIANS, SH_DEGREE = 75_000_000, 3_000_000, 3  # of the voxels, 10 million are the organ's
MOST_S, MOST_GB = 40, 4


def register_target(work: Path) -> dict:
    """Run `organphys register`; wall and processor time and peak memory of the process."""
    labels, splat = work / "target.nii.gz", work / "target.ply"
    organ_voxels = write_labels_of(labels, VOXELS)
    write_splat_of(splat, sample_splat(work / "sample"), GAUSSIANS, SH_DEGREE)
    code = "from organphys.pipeline.command_line import main; main()"
    words = ["register", "--labels", str(labels), "--splat", str(splat), "--organ", "5", "--quiet"]
    start = time.perf_counter()
    process = subprocess.Popen([sys.executable, "-c", code, *words, "--out", str(work / "target")])
    _, status, used = os.wait4(process.pid, 0)
    wall = time.perf_counter() - start
    if status:
        raise SystemExit(f"organphys register ended with status {status}")
    facts = {
        "voxels": VOXELS,
        "organ_voxels": organ_voxels,
        "gaussians": GAUSSIANS,
        "sh_degree": SH_DEGREE,
        "wall_s": wall,
        "processor_s": used.ru_utime + used.ru_stime,
        "peak_gb": used.ru_maxrss / 2**20,
        "load": os.getloadavg()[0],
    }
    return {"axis": "target", "value": GAUSSIANS, "made": when(), "facts": facts, "stages": {}}


def target_lines(records: list[dict]) -> list[str]:
    """What RESULTS.md says about it; nothing if it has not been run."""
    found = [(record["facts"], record["made"]) for record in records if record["axis"] == "target"]
    return [
        f"\n`organphys register` on {f['gaussians']:,} Gaussians of degree {f['sh_degree']} and a label map of "
        f"{f['voxels']:,} voxels, {f['organ_voxels']:,} of them the organ's: {f['processor_s']:.0f} s of processor "
        f"time, {f['wall_s']:.0f} s by the clock at a load of {f['load']:.1f}, {f['peak_gb']:.1f} GB at its peak "
        f"(aim: {MOST_S} s on two quiet cores, {MOST_GB} GB). "
        f"Measured by `python Testing/benchmarks/scaling.py --target`: {made}."
        for f, made in found
    ]
