"""The benchmark's report: tables, curves, and where OrganPhys is not ahead."""

import json

import bench_examples  # noqa: F401  (puts the benchmarks on the path)
import numpy as np
import pytest

from organphys_bench.report.comparisons import not_ahead, verdict_lines
from organphys_bench.report.paper_tables import ALPHAS, figure_8, settled
from organphys_bench.report.run_set import RunSet
from organphys_bench.report.sweeps import quartiles, sweep_curves
from organphys_bench.report.table import Table
from organphys_bench.report.write_report import write_report
from organphys_bench.runs.case_folders import case_folders
from organphys_bench.runs.conditions import Condition
from organphys_bench.runs.run_file import read_runs


def better(run, method, factor):
    """A run as of another method, with its TRE times ``factor``."""
    made = json.loads(json.dumps(run)) | {"method": method}
    for region in made["figures"]["tre_mm"].values():
        region["mean"] *= factor
    made["figures"]["ratio_to_oracle"] *= factor
    made["figures"]["stages"]["coarse"] = made["figures"]["stages"]["start"]
    return made


def test_the_report_stands_alone_and_names_where_we_are_behind(finished, tmp_path):
    run = read_runs(finished[1])[0]
    runs = [run, better(run, "organphys", 0.5), better(run, "similarity_icp", 0.4)]
    swept = [
        better(run, "organphys", level) | {"condition": vars(Condition("landmarks", level, seed))}
        for level in (3.0, 6.0)
        for seed in (0, 1)
    ]
    results = tmp_path / "RESULTS.md"
    cases = case_folders(finished[0])
    paths = write_report([*runs, *swept], cases, tmp_path, command="organphys-bench", results=results)
    html, part = (path.read_text(encoding="utf-8") for path in paths[1:3])
    assert "src='data:image/png;base64," in html
    assert "http" not in html.replace("http-equiv", "")
    assert "Sweep: landmarks" in html
    assert [path.name for path in paths[3:]] == ["bench_ratio.png", "bench_landmarks.png"]
    assert all(path.stat().st_size < 100_000 and f"]({path.name})" in part for path in paths[3:])
    lines = not_ahead(RunSet(runs))
    told = verdict_lines(RunSet([*runs, runs[1] | {"case": "other"}]))
    assert [line.split(":")[0] for line in told] == ["ahead of rigid ICP", "NOT ahead of similarity ICP"]
    assert "mean over 1 of 2 cases" in told[0]
    assert len(lines) == 1
    assert lines[0].startswith("tiny: similarity ICP has")
    assert f"- {lines[0]}" in part
    assert part.startswith("# OrganPhys beside its peers\n")
    main, sweeps = part.split("# OrganPhys beside its peers: sweeps\n")
    assert "3 runs" in main and "bench_ratio.png" in main
    assert "4 runs" in sweeps and "bench_landmarks.png" in sweeps
    record = json.loads(paths[0].read_text(encoding="utf-8"))
    assert len(record["runs"]) == 7
    assert "picture" not in record["runs"][0]


def swept_runs(run, sweep, levels, seeds):
    """Runs of ``sweep`` made of ``run``: {method: {level: factor}} and {method: seeds}."""
    return [
        better(run, method, factor) | {"condition": vars(Condition(sweep, level, seed))}
        for method, factors in levels.items()
        for level, factor in factors.items()
        for seed in seeds[method]
    ]


def test_curves_are_of_the_same_cases_for_every_method(finished):
    run = read_runs(finished[1])[0]
    levels = {"rigid_icp": {5: 1.0, 10: 1.5}, "organphys": {5: 0.5, 10: 9.0}}
    swept = swept_runs(run, "outliers", levels, {"rigid_icp": (0,), "organphys": (0, 1)})
    begun = [one | {"case": "begun"} for one in swept if one["condition"]["level"] == 5]
    (curves,) = sweep_curves(RunSet([run, better(run, "organphys", 0.5), *swept, *begun]))
    assert curves.cases == ("tiny",)
    as_it_is = run["figures"]["ratio_to_oracle"]
    assert curves.levels == [0.0, 5, 10]
    assert np.allclose([v for (v,) in curves.ratios["rigid_icp"].values()], as_it_is * np.array([1, 1, 1.5]))
    ours = curves.ratios["organphys"]
    assert [len(values) for values in ours.values()] == [1, 2, 2]
    assert np.allclose([values[0] for values in ours.values()], as_it_is * np.array([0.5, 0.5, 9]))
    assert [row[1] for row in curves.table.rows] == ["1", "1 or 2"]
    assert curves.table.rows[1][-1].endswith(" / 0 %")
    assert "OrganPhys fails in 2 of 6 runs, and says 'trust' in 0 of these." in curves.table.note
    assert (
        f"ahead but for: at 10 not of rigid ICP ({1.5 * as_it_is:.2f}), itself {9 * as_it_is:.2f}; "
        in curves.table.note
    )
    failed = [one | ({"failure": "no"} if one["method"] == "organphys" else {}) for one in swept]
    assert sweep_curves(RunSet(failed))[0].table.rows[1][-2:] == ("- / 0 %", "- / 0 %")


def test_a_method_that_lacks_a_case_has_no_curve_and_a_seed_that_lacks_one_does_not_count(finished):
    run = read_runs(finished[1])[0]
    levels = {"rigid_icp": {3.0: 1.0, 6.0: 1.0}, "organphys": {3.0: 0.5, 6.0: 0.5}}
    of_a, of_b = (
        [one | {"case": case} for one in swept_runs(run, "landmarks", levels, {"rigid_icp": (0,), "organphys": seeds})]
        for case, seeds in (("a", (0, 1)), ("b", (0,)))
    )
    (both,) = sweep_curves(RunSet([*of_a, *of_b]))
    assert {method: len(by_level[3.0]) for method, by_level in both.ratios.items()} == {"rigid_icp": 2, "organphys": 2}
    (ours,) = sweep_curves(RunSet([*of_a, *(one for one in of_b if one["method"] == "organphys")]))
    assert ours.cases == ("a", "b")
    assert list(ours.ratios) == ["organphys"]
    begun = [one | {"condition": one["condition"] | {"level": 10.0}} for one in of_b]
    (both,) = sweep_curves(RunSet([*of_a, *of_b, *begun]))
    assert (both.cases, both.levels) == (("a", "b"), [3.0, 6.0])


def test_a_curve_has_settled_where_it_stays_near_its_last_value():
    assert settled([2.0, 1.0, 1.5, 1.01, 1.0, 1.0]) == 4
    assert settled([1.0, 1.0]) == 1


def test_quartiles_hold_runs_without_a_result():
    assert np.allclose(quartiles(np.array([1.0, 2.0, 3.0])), [1.5, 2.0, 2.5])
    assert quartiles(np.array([1.0, 2.0, np.inf, np.inf])).tolist() == [1.75, np.inf, np.inf]


def test_figure_8_says_in_how_many_cases_the_order_is_the_papers():
    ends = {"a": [(0.03, -0.1), (0.02, -0.2), (0.01, -0.3)], "b": [(0.01, 0.1), (0.02, 0.0), (0.03, 0.1)]}
    runs = [
        {
            "case": case, "method": "paper_figure_8", "condition": vars(Condition()), "failure": "",
            "facts": {"figure_8": {a: [[0, 1, 0], [float(a), *end]] for a, end in zip(ALPHAS, rows, strict=True)}},
        }
        for case, rows in ends.items()
    ]  # fmt: skip
    note = figure_8(RunSet(runs)).note
    assert "the lowest residual in 1 of 2 cases, and with the smallest volume, below the CT's, in 1." in note
    assert "0 of 6 residuals end above" in note


def test_a_table_sets_the_smallest_in_bold_and_keeps_its_shape():
    table = Table("T", ("method", "mm"), (("a", "2.0"), ("b", "1.0"), ("c", "-")), best=frozenset({1}))
    assert "| b | **1.0** |" in table.markdown
    assert "<td><b>1.0</b></td>" in table.html
    assert table.markdown.count("**") == 2
    with pytest.raises(ValueError, match="cells"):
        Table("T", ("method",), (("a", "2.0"),))
