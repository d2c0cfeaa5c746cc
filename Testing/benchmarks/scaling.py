"""Processor time and memory of every stage against the size of the inputs, with fitted exponents and plots.

    OMP_NUM_THREADS=1 nice -n 10 python Testing/benchmarks/scaling.py [AXIS ...] [--work DIR] [--fresh] [--target]

Axes: voxels (of the label map), gaussians, surface (samples), handles, quadrature. Cases are made from the generated
sample. Every measurement is a process of its own and a line of scaling.jsonl, where a later call goes on; --fresh
measures the named axes anew. --target runs `organphys register` itself on 10 million voxels and 3 million Gaussians.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

from measured import when
from results_file import write_part
from scaling_case import sample_splat, write_labels_of, write_splat_of
from scaling_plot import scaling_plot
from scaling_report import report
from scaling_target import register_target

HERE = Path(__file__).parent
RECORD, PLOT = HERE / "scaling.jsonl", HERE / "scaling.png"
AXES = {
    "voxels": (10_000, 100_000, 1_000_000, 10_000_000, 75_000_000),
    "gaussians": (10_000, 100_000, 300_000, 1_000_000, 3_000_000),
    "surface": (1_000, 5_000, 20_000, 100_000),
    "handles": (5, 10, 20, 40, 80),
    "quadrature": (500, 1_500, 5_000, 15_000),
}
USUAL_VOXELS = 1_000_000  # label map of the axis gaussians


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("axes", nargs="*", metavar="AXIS", help=", ".join(AXES))
    parser.add_argument("--work", type=Path, help="folder for the cases, kept (some GB); else a temporary one")
    parser.add_argument("--fresh", action="store_true")
    parser.add_argument("--target", action="store_true")
    options = parser.parse_args()
    if unknown := set(options.axes) - set(AXES):
        parser.error(f"no axis {', '.join(sorted(unknown))}; choose from {', '.join(AXES)}")
    wanted = options.axes or ([] if options.target else list(AXES))
    records = [r for r in read_records() if not (options.fresh and r["axis"] in wanted)]
    with tempfile.TemporaryDirectory() as temporary:
        work = options.work or Path(temporary)
        work.mkdir(parents=True, exist_ok=True)
        for axis in wanted:
            for value in AXES[axis]:
                if not any((r["axis"], r["value"]) == (axis, value) for r in records):
                    records.append({"axis": axis, "value": value, **measured(axis, value, work)})
                    write_records(records)
        if options.target:
            records = [r for r in records if r["axis"] != "target"] + [register_target(work)]
            write_records(records)
    scaling_plot(PLOT, records)
    write_part(HERE / "RESULTS.md", report(records, list(AXES)))


def measured(axis: str, value: int, work: Path) -> dict:
    """One measurement in a process of its own."""
    splat = sample_splat(work / "sample")
    if axis in ("voxels", "gaussians"):
        labels = work / "labels.nii.gz"
        write_labels_of(labels, value if axis == "voxels" else USUAL_VOXELS)
        more = ["--grids"] if axis == "voxels" else []
        if axis == "gaussians":
            splat = work / "splat.ply"
            write_splat_of(splat, work / "sample" / "splat.ply", value, 3)
            more = ["--follow"]
        command = [str(HERE / "scaling_run.py"), str(labels), str(splat), *more]
    else:
        command = [str(HERE / "scaling_parts.py"), axis, str(value), str(work / "sample")]
    print(f"{axis} {value}", flush=True)
    done = subprocess.run([sys.executable, *command], capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"{axis} {value}: {done.stderr.strip().splitlines()[-1]}")
    return {"made": when(), **json.loads(done.stdout.splitlines()[-1])}


def read_records() -> list[dict]:
    """All measurements so far."""
    return [json.loads(line) for line in RECORD.read_text(encoding="utf-8").splitlines()] if RECORD.exists() else []


def write_records(records: list[dict]) -> None:
    """One line each, numbers short."""
    rounded = [
        json.loads(json.dumps(record), parse_float=lambda text: float(f"{float(text):.4g}")) for record in records
    ]
    RECORD.write_text("".join(json.dumps(record) + "\n" for record in rounded), encoding="utf-8")


if __name__ == "__main__":
    main()
