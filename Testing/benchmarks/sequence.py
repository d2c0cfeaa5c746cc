"""Following an organ: accuracy, jitter and seconds per frame against a full registration of every frame.

python Testing/benchmarks/sequence.py [CASE_FOLDER ...] [--frames N] [--damping D ...] [--no-write]
"""

from __future__ import annotations

import argparse
import copy
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from measured import how
from results_file import write_part
from sequence_cases import SequenceCase, folder_sequence, sample_sequence

from organphys.pipeline.register import register
from organphys.pipeline.sequence import SequenceFollower
from organphys.pipeline.tracking import FollowOptions

RESULTS = Path(__file__).with_name("RESULTS.md")
DAMPINGS = (0.0, 0.005, 0.01, 0.02, 0.05, 0.2)


@dataclass(frozen=True)
class Track:
    """TRE (T,) mm mean of all points per frame, jitter mm, seconds and processor seconds (T,) per frame."""

    tre: np.ndarray
    jitter: float
    seconds: np.ndarray
    cpu: np.ndarray
    lost: int = 0


def track_of(case: SequenceCase, mapped: np.ndarray, seconds: Sequence, cpu: Sequence, lost: int = 0) -> Track:
    """``mapped`` (T, N, 3), scene units. Jitter: mean length of the change of the error from frame to frame."""
    true = np.stack([places for _, places in case.frames()])
    error = (mapped - true) * case.mm_per_unit
    jitter = float(np.linalg.norm(np.diff(error, axis=0), axis=2).mean())
    return Track(np.linalg.norm(error, axis=2).mean(1), jitter, np.array(seconds), np.array(cpu), lost)


def followed(case: SequenceCase, first: SequenceFollower, damping: float) -> Track:
    """From a follower that has seen the first frame."""
    follower = copy.copy(first)
    follower.frames, follower.follow = list(first.frames), FollowOptions(damping=damping)
    cpu = [0.0]
    for k, (splat, _) in enumerate(case.frames()):
        if k:
            begin = time.process_time()
            follower.add(splat, float(k))
            cpu.append(time.process_time() - begin)
    sequence = follower.sequence
    mapped = np.stack([sequence.map_points(case.points_ct, k) for k in range(len(sequence))])
    lost = sum(status in ("lost", "restarted") for status in sequence.status)
    return track_of(case, mapped, sequence.figures["seconds"], cpu, lost)


def alone(case: SequenceCase) -> Track:
    """Every frame registered in full."""
    mapped, seconds, cpu = [], [], []
    for splat, _ in case.frames():
        begin = time.perf_counter(), time.process_time()
        organ = register(case.organ, splat, landmarks=case.landmarks, box=case.box).organ
        seconds.append(time.perf_counter() - begin[0])
        cpu.append(time.process_time() - begin[1])
        mapped.append(organ.map_points(case.points_ct))
    return track_of(case, np.stack(mapped), seconds, cpu)


def rows_of(case: SequenceCase, dampings: Sequence[float]) -> list[str]:
    """Table rows: a full registration of every frame, and following with each damping."""
    follower = SequenceFollower(case.organ, landmarks=case.landmarks, box=case.box)
    follower.add(next(case.frames())[0], 0.0)
    rows = [_row(case.name, "every frame in full", alone(case))]
    print(rows[-1], flush=True)
    for damping in dampings:
        default = " (default)" if damping == FollowOptions().damping else ""
        rows.append(_row(case.name, f"followed, damping {damping:g}{default}", followed(case, follower, damping)))
        print(rows[-1], flush=True)
    return rows


def _row(name: str, how_: str, track: Track) -> str:
    further = slice(1, None)
    return (
        f"| {name} | {how_} | {track.tre.mean():.2f} | {track.tre.max():.2f} | {track.jitter:.2f} "
        f"| {np.median(track.seconds[further]):.2f} | {np.percentile(track.seconds[further], 95):.2f} "
        f"| {np.median(track.cpu[further]):.2f} | {track.lost} |"
    )


def markdown(rows: Sequence[str], command: str, frames: int) -> str:
    """This benchmark's part of RESULTS.md."""
    return "\n".join(
        [
            "# Following an organ over time",
            "",
            f"{frames} frames of one breath (deformation 0 to 1 and back) with fresh noise in each. `sample`: the "
            "sample case's flow interpolated, with 3 degrees and 8 mm of rigid motion; a case folder: its splat "
            "between the oracle similarity and its true state. TRE in mm over all true points; jitter: mean change of "
            "the error vector from frame to frame, mm. Seconds per further frame without reading its file; processor "
            "seconds are of all threads together, an upper bound of the time on two quiet cores.",
            "",
            how(command),
            "",
            "| case | how | TRE mean | worst frame | jitter | s median | s p95 | processor s median | lost |",
            "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
            *rows,
        ]
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cases", type=Path, nargs="*")
    parser.add_argument("--frames", type=int, default=12)
    parser.add_argument("--damping", type=float, nargs="+", default=DAMPINGS)
    parser.add_argument("--no-write", action="store_true")
    arguments = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        cases = [sample_sequence(arguments.frames, Path(folder))]
        cases += [folder_sequence(path, arguments.frames) for path in arguments.cases]
        for case in cases:
            rows += rows_of(case, arguments.damping)
    if not arguments.no_write:
        named = " ".join(path.name for path in arguments.cases)
        command = f"python Testing/benchmarks/sequence.py {named} --frames {arguments.frames}"
        if tuple(arguments.damping) != DAMPINGS:
            command += f" --damping {' '.join(f'{damping:g}' for damping in arguments.damping)}"
        write_part(RESULTS, markdown(rows, command, arguments.frames))


if __name__ == "__main__":
    sys.exit(main())
