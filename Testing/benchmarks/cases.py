"""Register every case of a folder by the command line, compare with the truth, write its part of RESULTS.md.

    python Testing/benchmarks/cases.py DIR [--method organphys,paper] [--only NAME,...]

Every run is a fresh process. A case is a folder with case.json, ct_labels.nii.gz, splat.ply, landmarks.mrk.json and
truth.npz; the truth is read here only, after a run (its unit also before, for the runs that are given the unit).
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from results_file import write_part
from results_table import results_markdown

from organphys.pipeline.evaluation import Truth, mean_by_region, oracle_by_region, read_truth

PRESETS = ("conservative", "moderate", "aggressive")
TIMEOUT_S = 1800


@dataclass(frozen=True)
class Variant:
    """One way to run a case: a name for the table, and options of ``organphys register``."""

    name: str
    method: str
    landmarks: bool = True
    unit: bool = False
    options: tuple[str, ...] = ()


@dataclass(frozen=True)
class Outcome:
    """One run: TRE in mm per stage and region, scale error in percent, wall seconds, and registration.json.

    ``failure`` is the error line of a run that gave no result.
    """

    tre_mm: dict[str, dict[str, float]] = field(default_factory=dict)
    scale_error_percent: float = float("nan")
    wall_seconds: float = float("nan")
    record: dict = field(default_factory=dict)
    failure: str = ""


@dataclass(frozen=True)
class CaseOutcome:
    """All runs of one case, with the TRE of the best similarity (mm, per region)."""

    name: str
    oracle_mm: dict[str, float]
    runs: dict[str, Outcome]


VARIANTS = (
    Variant("landmarks", "organphys"),
    Variant("no landmarks", "organphys", landmarks=False),
    Variant("with the unit", "organphys", unit=True),
    *(Variant(f"paper {preset}", "paper", options=("--stiffness", preset)) for preset in PRESETS),
)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="folder of case folders")
    parser.add_argument("--method", default="organphys,paper", help="methods to run (default: organphys,paper)")
    parser.add_argument("--only", default="", help="names of cases, separated by commas (default: all)")
    parser.add_argument("--out", type=Path, default=Path(__file__).with_name("RESULTS.md"), help="table to write")
    arguments = parser.parse_args()
    only = set(filter(None, arguments.only.split(",")))
    folders = sorted(path.parent for path in arguments.folder.glob("*/case.json"))
    folders = [folder for folder in folders if not only or folder.name in only]
    if not folders:
        parser.error(f"no cases in {arguments.folder}")
    variants = [variant for variant in VARIANTS if variant.method in arguments.method.split(",")]
    cases = [run_case(folder, variants) for folder in folders]
    shown = f"python Testing/benchmarks/cases.py {arguments.folder.name} --method {arguments.method}"
    write_part(arguments.out, results_markdown(cases, command=shown))
    print(arguments.out)


def run_case(folder: Path, variants: list[Variant]) -> CaseOutcome:
    """Every variant of one case; a line per run goes to stdout."""
    truth = read_truth(folder / "truth.npz")
    oracle, runs = oracle_by_region(truth), {}
    for variant in variants:
        runs[variant.name] = outcome = run_variant(folder, variant, truth)
        result = outcome.failure
        if not result:
            tre = outcome.tre_mm["elastic"]["all"]
            result = f"TRE {tre:.2f} mm, ratio {tre / oracle['all']:.2f}, scale {outcome.scale_error_percent:+.1f} %"
        print(f"{folder.name:16s}{variant.name:20s}{result}, {outcome.wall_seconds:.1f} s", flush=True)
    return CaseOutcome(folder.name, oracle, runs)


def run_variant(folder: Path, variant: Variant, truth: Truth) -> Outcome:
    """One registration in a fresh process, and its errors."""
    with tempfile.TemporaryDirectory() as out:
        command = [sys.executable, "-m", "organphys", *register_options(folder, variant, truth), "--out", out]
        begin = time.perf_counter()
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT_S)
        except subprocess.TimeoutExpired:
            return Outcome(failure=f"no result within {TIMEOUT_S} s", wall_seconds=TIMEOUT_S)
        wall = time.perf_counter() - begin
        if done.returncode:
            return Outcome(failure=(done.stderr.strip().splitlines() or ["failed"])[-1], wall_seconds=wall)
        record = json.loads((Path(out) / "registration.json").read_text(encoding="utf-8"))
        mapped = map_points(Path(out), truth)
    tre = {"elastic": mean_by_region(truth, mapped)}
    for stage in ("coarse", "rigid"):
        T_scene_ct = np.array(record["similarities"][stage])
        tre[stage] = mean_by_region(truth, truth.points_ct @ T_scene_ct[:3, :3].T + T_scene_ct[:3, 3])
    scale_error = 100 * (record["scale_scene_per_mm"] * truth.mm_per_unit - 1)
    return Outcome(tre, scale_error, wall, record)


def map_points(folder: Path, truth: Truth) -> np.ndarray:
    """The truth's CT points (N, 3) in scene units, by ``organphys map``.

    In its own process too: a large parent would count as the peak memory of every later run (Linux hands it on).
    """
    np.save(folder / "points.npy", truth.points_ct)
    command = [sys.executable, "-m", "organphys", "map", str(folder / "organ.organphys"), "--quiet"]
    command += ["--points", str(folder / "points.npy"), "--out", str(folder / "mapped.npy")]
    subprocess.run(command, check=True, timeout=TIMEOUT_S)
    return np.load(folder / "mapped.npy")


def register_options(folder: Path, variant: Variant, truth: Truth) -> list[str]:
    """The command line of ``organphys register`` for a case, without --out."""
    facts = json.loads((folder / "case.json").read_text(encoding="utf-8"))
    options = ["register", "--quiet", "--labels", str(folder / "ct_labels.nii.gz"), "--organ", str(facts["label_id"])]
    options += ["--splat", str(folder / "splat.ply"), "--method", variant.method, *variant.options]
    if variant.landmarks:
        options += ["--landmarks", str(folder / "landmarks.mrk.json")]
    if facts.get("roi") is not None:
        options += ["--roi", str(folder / "case.json")]
    if variant.unit:
        options += ["--mm-per-unit", repr(truth.mm_per_unit)]
    return options


if __name__ == "__main__":
    main()
