"""Does the verdict tell right registrations from broken ones? Registers good and deliberately broken cases.

    python Testing/benchmarks/broken_runs.py DIR [--more] [--cache FILE]

Every case as it is, with landmarks on the wrong side, mirrored, with a tenth of its surface seen, and with the organ of
another case; with --more also with a unit that is wrong by 25 %, and a second wrong organ. Writes its part of
RESULTS.md.
"""

from __future__ import annotations

import argparse
import json
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from broken_cases import BREAKS, wrong_organ
from case_inputs import CaseInputs, read_case
from measured import how
from results_file import write_part
from results_table import _table

from organphys.pipeline.register import register
from organphys.pipeline.registration import RegisterOptions
from organphys.pipeline.verdict import REFUSE, TRUST, VerdictLimits
from organphys.points.point_sets import SceneUnit

TITLE = "# Verdict on good and on broken runs"
GOOD, UNIT = "good", "unit wrong by 25 %"
Entry = dict[str, Any]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="folder of case folders")
    parser.add_argument("--more", action="store_true", help="wrong units and a second wrong organ as well")
    parser.add_argument("--cache", type=Path, help="file that keeps the runs, to go on after a break")
    parser.add_argument("--out", type=Path, default=Path(__file__).with_name("RESULTS.md"))
    options = parser.parse_args()
    cases = [read_case(path.parent) for path in sorted(options.folder.glob("*/case.json"))]
    known = json.loads(options.cache.read_text()) if options.cache and options.cache.exists() else {}
    for key, broken, unit in plans(cases, more=options.more):
        if key not in known:
            known[key] = run(broken, unit)
            print(f"{key}: {known[key]['level']} {known[key]['codes']} cost {known[key]['score']:.2f}", flush=True)
            if options.cache:
                options.cache.write_text(json.dumps(known))
    command = f"python Testing/benchmarks/broken_runs.py {options.folder.name}{' --more' if options.more else ''}"
    write_part(options.out, markdown(command, known))


def plans(cases: list[CaseInputs], *, more: bool) -> Iterator[tuple[str, CaseInputs, SceneUnit | None]]:
    """Case and what was done to it, with the inputs and the unit stated."""
    for case in cases:
        yield f"{case.name} | {GOOD}", case, None
    for name, change in BREAKS.items():
        for case in cases:
            yield f"{case.name} | {name}", change(case, np.random.default_rng(zlib.crc32(case.name.encode()))), None
    for case, other in _pairs(cases, 1):
        yield f"{case.name} | organ of {other.name}", wrong_organ(other)(case), None
    for case in cases if more else ():
        yield f"{case.name} | {UNIT}", case, SceneUnit(1.25 * case.truth.mm_per_unit)
    for case, other in _pairs(cases, 3) if more else ():
        yield f"{case.name} | organ of {other.name}", wrong_organ(other)(case), None


def _pairs(cases: list[CaseInputs], step: int) -> Iterator[tuple[CaseInputs, CaseInputs]]:
    """Every case with another one, ``step`` further, of another organ."""
    for case, other in zip(cases, cases[step:] + cases[:step], strict=True):
        if other.name.split("_")[0] != case.name.split("_")[0]:
            yield case, other


def run(case: CaseInputs, unit: SceneUnit | None) -> Entry:
    """One registration: its verdict, and where the truth still holds its error over the oracle's."""
    found = register(
        case.organ, case.splat, RegisterOptions(), landmarks=case.landmarks, camera=case.camera, box=case.box, unit=unit
    )
    evidence = found.evidence
    away = found.organ.outside_distance_mm(case.truth.points_ct)
    own = np.percentile(away, 90) < 5  # mm: the truth is this organ's
    return {
        "level": found.verdict.level,
        "codes": [reason.code for reason in found.verdict.reasons],
        "score": evidence.score,
        "mirrored": evidence.mirrored,
        "seen": evidence.seen,
        "ratio": float(case.ratio(found.organ.map_points(case.truth.points_ct))) if own else float("nan"),
    }


def markdown(command: str, entries: dict[str, Entry]) -> str:
    """The part of RESULTS.md."""
    rows = []
    for key, entry in entries.items():
        name, what = key.split(" | ")
        ratio = "" if what == "mirrored splat" or np.isnan(entry["ratio"]) else f"{entry['ratio']:.2f}"
        mirrored = "" if entry["mirrored"] is None else f"{entry['mirrored']:.2f}"
        numbers = [f"{entry['score']:.2f}", mirrored, f"{100 * entry['seen']:.0f}", ratio]
        rows.append([name, what, f"**{entry['level']}**", ", ".join(entry["codes"]), *numbers])
    good = {key: entry for key, entry in entries.items() if key.endswith(f"| {GOOD}")}
    broken = {key: entry for key, entry in entries.items() if key not in good}
    trusted = sum(entry["level"] == TRUST for entry in good.values())
    refused = sum(entry["level"] == REFUSE for entry in good.values())
    missed = [key for key, entry in broken.items() if entry["level"] == TRUST]
    columns = ["case", "what", "verdict", "reasons", "cost", "mirror image's cost", "seen %", "TRE / oracle"]
    return (
        "\n\n".join(
            [
                TITLE,
                how(command),
                f"Good runs: {trusted} of {len(good)} trusted, {refused} refused (do not trust). "
                f"Broken runs: {len(missed)} of {len(broken)} trusted{': ' + ', '.join(missed) if missed else ''}. "
                + _left_out(good, broken),
                _table(columns, rows),
            ]
        )
        + "\n"
    )


def _left_out(good: dict[str, Entry], broken: dict[str, Entry]) -> str:
    """The limit of the cost, put midway between the other cases' good and badly fitting runs, on the case left out."""
    limit, right, caught, bad = VerdictLimits().score[0], 0, 0, 0
    names = sorted({key.split(" | ")[0] for key in good})
    poor = {key: entry for key, entry in broken.items() if entry["score"] > limit}
    for name in names:
        highest = max(entry["score"] for key, entry in good.items() if not key.startswith(name))
        lowest = min(entry["score"] for key, entry in poor.items() if not key.startswith(name))
        middle = float(np.sqrt(highest * lowest))
        right += sum(entry["score"] <= middle for key, entry in good.items() if key.startswith(name))
        own = [entry for key, entry in poor.items() if key.startswith(name)]
        caught, bad = caught + sum(entry["score"] > middle for entry in own), bad + len(own)
    return (
        f"Leaving out one case at a time, a limit of the cost midway (geometric mean) between the good and the badly "
        f"fitting runs of the others passes {right} of {len(good)} good runs and catches {caught} of {bad} badly "
        f"fitting ones (cost above {limit:g}); the others are caught by their other reasons."
    )


if __name__ == "__main__":
    main()
