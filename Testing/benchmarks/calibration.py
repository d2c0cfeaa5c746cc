"""Are the error radii right? Registers cases with known truth and counts how often the error lies within its radius.

    python Testing/benchmarks/calibration.py DIR [--seeds 3] [--samples 4] [--cache DIR]

The two constants of the posterior (elastic/posterior.py) are fitted leaving out one case at a time, and what they give
on the case left out is what counts. Sample cases, which never serve the fit, are added as other truths. Writes its part
of RESULTS.md and calibration.png beside it, and prints the constants fitted on all cases, which the product holds.
"""

from __future__ import annotations

import argparse
import itertools
from pathlib import Path

import numpy as np
from calibration_plot import reliability_plot
from calibration_runs import Run, runs_of
from measured import how
from results_file import write_part
from results_table import _table

from organphys.elastic.posterior import PosteriorConstants

TITLE = "# Calibration of the error radii"
LEVELS = (0.68, 0.95)
ALLOWED = ((0.60, 0.76), (0.90, 0.98))
CURVE = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.68, 0.75, 0.8, 0.85, 0.9, 0.95, 0.98)
REGIONS = ("visible", "hidden", "interior")
EXPLANATION = """Share of the true error lengths within the 68 % and the 95 % radius, in percent. Every case is judged
with constants fitted on the others: the variance factor k of the data and the energy T of a degree of freedom (the
Student t has 6 degrees of freedom throughout). Wanted: 60 to 76 within the 68 % radius and 90 to 98 within the 95 %
radius, pooled, in each region: **{met}**. Errors of one case are strongly correlated, so single cases scatter far more
than pooled ones. Fitted on all cases: {fitted}; the product holds {product}."""
GRID = [
    PosteriorConstants(data=data, temperature=temperature)
    for data, temperature in itertools.product(
        (1.0, 1.5, 2.0, 3.0, 4.5), (3e-5, 5e-5, 7e-5, 1e-4, 1.5e-4, 2e-4, 2.5e-4, 3e-4, 4.5e-4, 7e-4)
    )
]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="folder of case folders")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--samples", type=int, default=4, help="sample cases with other deformations")
    parser.add_argument("--cache", type=Path, default=Path("calibration_cache"), help="registrations, kept for re-fits")
    parser.add_argument("--out", type=Path, default=Path(__file__).with_name("RESULTS.md"))
    options = parser.parse_args()
    runs = list(runs_of(options.folder, range(options.seeds), options.samples, options.cache))
    samples = [run for run in runs if run.case.startswith("sample_")]
    runs = [run for run in runs if not run.case.startswith("sample_")]
    tables = {constants: np.array([coverage(run, constants, LEVELS) for run in runs]) for constants in GRID}
    cases = np.array([run.case for run in runs])
    everything = best(tables, np.ones(len(runs), dtype=bool))
    chosen = {case: best(tables, cases != case) for case in sorted(set(cases))}
    held_out = np.array([coverage(run, chosen[run.case], CURVE) for run in runs])
    reliability_plot(options.out.with_name("calibration.png"), CURVE, held_out, cases)
    command = f"python Testing/benchmarks/calibration.py {options.folder.name} --seeds {options.seeds} "
    command += f"--samples {options.samples}"
    product = [coverage(run, PosteriorConstants(), LEVELS) for run in samples]
    text = markdown(command, runs, chosen, held_out, everything, product)
    write_part(options.out, text)
    print(f"fitted on all cases: {everything}; the product holds {PosteriorConstants()}")


def coverage(run: Run, constants: PosteriorConstants, levels: tuple[float, ...]) -> np.ndarray:
    """Share of the points of each region whose error lies within its radius, (3, levels)."""
    inside = run.error_mm <= run.radii(constants, levels)
    return np.array([inside[:, run.region == region].mean(axis=1) for region in range(len(REGIONS))])


def best(tables: dict[PosteriorConstants, np.ndarray], of: np.ndarray) -> PosteriorConstants:
    """The constants whose pooled coverage of the runs ``of`` (bool) is nearest to what the radii promise."""
    half = np.array([(high - low) / 2 for low, high in ALLOWED])
    return min(tables, key=lambda key: (((tables[key][of].mean(axis=0) - LEVELS) / half) ** 2).sum())


def markdown(
    command: str,
    runs: list[Run],
    chosen: dict[str, PosteriorConstants],
    held_out: np.ndarray,
    everything: PosteriorConstants,
    product: list[np.ndarray],
) -> str:
    """The part of RESULTS.md."""
    shown = held_out[:, :, [CURVE.index(level) for level in LEVELS]]
    names = np.array([run.case for run in runs])
    unit = np.array([run.unit for run in runs])
    groups = [("**all cases, pooled**", np.ones(len(runs), dtype=bool))]
    groups += [("without the unit", ~unit), ("with the unit", unit), *((name, names == name) for name in chosen)]
    rows = [_row(name, shown[of], chosen.get(name)) for name, of in groups]
    if product:
        rows.append(_row(f"{len(product)} sample cases (not in any fit)", np.array(product), PosteriorConstants()))
    pooled = shown.mean(axis=0)
    met = all(low <= pooled[r, k] <= high for k, (low, high) in enumerate(ALLOWED) for r in range(len(REGIONS)))
    columns = ["", *(f"{region}, {100 * level:.0f} %" for region in REGIONS for level in LEVELS), "data k", "T"]
    return (
        "\n\n".join(
            [
                TITLE,
                f"{how(command)}\n- {len(runs)} registrations: {len(chosen)} cases, seeds, without and with the unit",
                EXPLANATION.format(
                    met="met" if met else "not met",
                    fitted=_words(everything),
                    product=_words(PosteriorConstants()),
                ),
                _table(columns, rows),
                "![Reliability](calibration.png)",
            ]
        )
        + "\n"
    )


def _words(constants: PosteriorConstants) -> str:
    return f"k = {constants.data:g}, T = {constants.temperature:g}"


def _row(name: str, shares: np.ndarray, constants: PosteriorConstants | None) -> list[str]:
    cells = [f"{100 * value:.0f}" for value in shares.mean(axis=0).ravel()]
    fitted = ["", ""] if constants is None else [f"{constants.data:g}", f"{constants.temperature:g}"]
    return [name, *cells, *fitted]


if __name__ == "__main__":
    main()
