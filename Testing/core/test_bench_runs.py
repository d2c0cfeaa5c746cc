"""The benchmark's runs and report: what is run, what is kept, what is written."""

import json
from types import SimpleNamespace

import bench_examples  # noqa: F401  (puts the benchmarks on the path)
import numpy as np
import pytest

from organphys.ground.checks import InputError
from organphys.pipeline.sample_case import write_sample_case
from organphys_bench import command_line
from organphys_bench.report.comparisons import not_ahead, verdict_lines
from organphys_bench.report.paper_tables import ALPHAS, figure_8, settled
from organphys_bench.report.run_set import RunSet
from organphys_bench.report.sweeps import quartiles, sweep_curves
from organphys_bench.report.table import Table
from organphys_bench.report.write_report import write_report
from organphys_bench.runs.case_folders import case_folders
from organphys_bench.runs.conditions import SWEEPS, Condition, full_conditions
from organphys_bench.runs.pool import run_all, run_one
from organphys_bench.runs.run_file import RunKey, read_runs, write_run

KEY = RunKey("tiny", "rigid_icp", Condition())


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A sample case registered by one method in a child process: case folder and output folder."""
    root = tmp_path_factory.mktemp("bench")
    write_sample_case(root / "cases" / "tiny", size="small")
    word = run_one(KEY, root / "cases" / "tiny", KEY.path(root / "out"))
    assert word == "done"
    return root / "cases", root / "out"


def test_a_run_holds_every_figure(finished):
    run = read_runs(finished[1])[0]
    figures = run["figures"]
    assert run["failure"] == ""
    assert (run["case"], run["method"], run["condition"]) == ("tiny", "rigid_icp", vars(Condition()))
    assert set(figures["tre_mm"]) == {"all", "visible", "hidden", "interior"}
    assert set(figures["tre_mm"]["all"]) == {"mean", "median", "p95", "max"}
    assert 0.5 < figures["ratio_to_oracle"] < 20
    assert np.isclose(figures["ratio_to_oracle"], figures["tre_mm"]["all"]["mean"] / figures["oracle_mm"])
    assert abs(figures["deformation"]["volume_drift_percent"]) < 1e-6
    assert {"start", "icp", "total"} <= set(run["seconds"])
    assert run["peak_memory_mb"] is None or run["peak_memory_mb"] > 50


def test_what_has_run_is_not_run_again(finished, monkeypatch):
    said, asked = [], []
    monkeypatch.setattr("organphys_bench.runs.pool.run_one", lambda key, *_: asked.append(key) or "done")
    other = RunKey("tiny", "similarity_icp", Condition())
    run_all([KEY, other], {"tiny": finished[0] / "tiny"}, finished[1], jobs=1, tell=said.append)
    assert asked == [other]
    assert said[0] == f"1 of 2 runs are there already, of commit {KEY.commit(finished[1])}"


def test_fresh_runs_begin_anew(finished, tmp_path, monkeypatch):
    path = KEY.path(tmp_path)
    write_run(path, KEY, {"failure": "old"})
    monkeypatch.setattr(command_line, "run_all", lambda *_, **__: write_run(path, KEY, {"failure": str(path.exists())}))
    monkeypatch.setattr("organphys_bench.report.write_report.write_report", lambda *_, **__: [])
    command_line.main(["--cases", str(finished[0]), "--out", str(tmp_path), "--methods", "rigid_icp", "--fresh"])
    assert read_runs(tmp_path)[0]["failure"] == "False"


def test_a_method_that_dies_is_a_failure_and_a_kill_is_not(tmp_path, monkeypatch):
    path = KEY.path(tmp_path)
    ended = SimpleNamespace(returncode=1, stderr="Traceback\nValueError: no\n")
    monkeypatch.setattr("organphys_bench.runs.pool.subprocess.run", lambda *_, **__: ended)
    monkeypatch.setattr("organphys_bench.runs.run_file.commit", lambda: "none")
    assert "ValueError: no" in run_one(KEY, tmp_path, path)
    assert json.loads(path.read_text(encoding="utf-8"))["failure"] == "ValueError: no"
    path.unlink()
    ended.returncode = -2
    run_one(KEY, tmp_path, path)
    assert not path.exists()


def better(run, method, factor):
    """A run as of another method, with its TRE times ``factor``."""
    made = json.loads(json.dumps(run)) | {"method": method}
    for region in made["figures"]["tre_mm"].values():
        region["mean"] *= factor
    made["figures"]["ratio_to_oracle"] *= factor
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
    record = json.loads(paths[0].read_text(encoding="utf-8"))
    assert len(record["runs"]) == 7
    assert "picture" not in record["runs"][0]


def test_curves_are_of_the_same_cases_and_seeds_for_every_method(finished):
    run = read_runs(finished[1])[0]
    levels = {"rigid_icp": {5: 1.0, 10: 1.5, 20: 9.0}, "organphys": {5: 0.5, 10: 9.0}}
    swept = [
        better(run, method, factor) | {"condition": vars(Condition("outliers", level, seed))}
        for method, factors in levels.items()
        for level, factor in factors.items()
        for seed in ((0, 1) if method == "organphys" else (0,))
    ]
    (curves,) = sweep_curves(RunSet([run, better(run, "organphys", 0.5), *swept]))
    as_it_is = run["figures"]["ratio_to_oracle"]
    assert curves.levels == [0.0, 5, 10]
    assert np.allclose([v for (v,) in curves.ratios["rigid_icp"].values()], as_it_is * np.array([1, 1, 1.5]))
    assert np.allclose([v for (v,) in curves.ratios["organphys"].values()], as_it_is * np.array([0.5, 0.5, 9]))
    last = curves.table.rows[-1]
    assert last[:2] == ("10", "1")
    assert last[-1] == "0"
    assert "OrganPhys fails in 2 of 4 runs, and says 'trust' in 0 of these." in curves.table.note
    failed = [one | ({"failure": "no"} if one["method"] == "organphys" else {}) for one in swept]
    assert sweep_curves(RunSet(failed))[0].table.rows[0][-2:] == ("-", "0")


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


def test_conditions_go_to_text_and_back():
    for condition in (Condition(), *full_conditions()):
        assert Condition.parse(condition.text) == condition
    with pytest.raises(InputError, match="condition"):
        Condition.parse("landmarks-3")
    assert sum(c.sweep == "landmarks" for c in full_conditions()) == len(SWEEPS["landmarks"].levels) * 10


@pytest.mark.parametrize("text", ["landmarks-6-1", "noise-0.6-0", "outliers-20-2", "cut-10-0", "visibility-25-0"])
def test_conditions_change_the_case(finished, text):
    from case_inputs import read_case

    case = read_case(finished[0] / "tiny")
    changed = Condition.parse(text).changed(case)
    again = Condition.parse(text).changed(case)
    assert np.array_equal(changed.splat.centres, again.splat.centres)
    if text.startswith("landmarks"):
        away = np.linalg.norm(changed.landmarks.positions - case.landmarks.positions, axis=1)
        assert (away > 1).all()
    else:
        assert len(changed.splat) != len(case.splat)


def test_a_made_splat_shows_the_share_that_was_asked_for(finished):
    from case_inputs import read_case
    from scipy.spatial import cKDTree

    from organphys_bench.runs.visibility import true_surface

    case = read_case(finished[0] / "tiny")
    surface, mm = true_surface(case), case.truth.mm_per_unit
    off = cKDTree(surface).query(case.truth.points_scene[case.truth.region < 2])[0] * mm
    assert np.median(off) < 2.0  # vertices are about 4 mm apart
    seen = Condition("visibility", 25.0, 0).changed(case)
    near = cKDTree(seen.splat.centres).query(case.truth.points_scene)[0] * mm
    share = (near[case.truth.region < 2] < 3).mean()
    assert 0.2 < share < 0.38


@pytest.mark.parametrize("percent", [10.0, 15.0])
def test_a_cut_splat_shows_the_share_that_was_asked_for(finished, percent):
    from case_inputs import read_case
    from scipy.spatial import cKDTree

    case = read_case(finished[0] / "tiny")
    cut = Condition("cut", percent, 1).changed(case)
    mm, surface = case.truth.mm_per_unit, case.truth.region < 2
    share = (cKDTree(cut.splat.centres).query(case.truth.points_scene[surface])[0] * mm < 3).mean()
    assert abs(100 * share - percent) < 4
    assert len(Condition("cut", 100.0, 1).changed(case).splat) == len(case.splat)


def test_case_folders_are_checked(finished, tmp_path):
    assert list(case_folders(finished[0])) == ["tiny"]
    assert list(case_folders(finished[0] / "tiny")) == ["tiny"]
    with pytest.raises(InputError, match="no case in"):
        case_folders(tmp_path)
    (tmp_path / "half").mkdir()
    (tmp_path / "half" / "case.json").write_text("{}", encoding="utf-8")
    with pytest.raises(InputError, match=r"half lacks ct_labels.nii.gz, splat.ply"):
        case_folders(tmp_path)


def test_a_missing_extra_is_told_in_one_line(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(command_line, "find_spec", lambda name: None if name == "pycpd" else object())
    with pytest.raises(SystemExit) as ended:
        command_line.main(["--cases", str(tmp_path)])
    assert ended.value.code == 2
    said = capsys.readouterr().err
    assert said == "organphys-bench: pycpd not installed: pip install -e '.[bench]' in a checkout of OrganPhys\n"


def plan(*arguments):
    every = {"a": None, "b": None}
    return command_line.planned(command_line.parser().parse_args(["--cases", "none", *arguments]), every)


def test_the_plan_is_the_baseline_method_by_method_then_the_sweeps():
    keys = plan("--methods", "paper_figure_8,rigid_icp", "--full", "--sweep-methods", "organphys")
    assert [(key.method, key.case) for key in keys[:4]] == [
        ("rigid_icp", "a"), ("rigid_icp", "b"), ("paper_figure_8", "a"), ("paper_figure_8", "b"),
    ]  # fmt: skip
    assert {key.method for key in keys[4:]} == {"organphys"}
    assert len(keys) == 4 + 2 * len(full_conditions())
    assert [key.condition.seed for key in keys] == sorted(key.condition.seed for key in keys)


def test_the_plan_can_be_a_part_of_it():
    keys = plan("--methods", "", "--full", "--sweeps", "landmarks", "--sweep-cases", "b")
    assert {(key.case, key.condition.sweep) for key in keys} == {("b", "landmarks")}
    assert {key.case for key in plan("--only", "a", "--full")} == {"a"}
    for arguments, word in (("--methods", "method"), ("--only", "case"), ("--sweep-cases", "case")):
        with pytest.raises(InputError, match=f"no {word} magic"):
            plan(arguments, "magic", "--full")
    with pytest.raises(InputError, match="no sweep magic"):
        plan("--sweeps", "magic", "--full")


def test_no_run_begins_when_the_minutes_are_over(tmp_path, monkeypatch):
    said, asked = [], []
    monkeypatch.setattr("organphys_bench.runs.pool.run_one", lambda key, *_: asked.append(key) or "done")
    run_all([KEY], {"tiny": tmp_path}, tmp_path, jobs=1, minutes=-1.0, tell=said.append)
    assert asked == []
    assert said == ["1 runs are left for another time: -1 minutes are over"]
    run_all([KEY], {"tiny": tmp_path}, tmp_path, jobs=1, minutes=5.0, tell=said.append)
    assert asked == [KEY]


def test_a_table_sets_the_smallest_in_bold_and_keeps_its_shape():
    table = Table("T", ("method", "mm"), (("a", "2.0"), ("b", "1.0"), ("c", "-")), best=frozenset({1}))
    assert "| b | **1.0** |" in table.markdown
    assert "<td><b>1.0</b></td>" in table.html
    assert table.markdown.count("**") == 2
    with pytest.raises(ValueError, match="cells"):
        Table("T", ("method",), (("a", "2.0"),))


def test_runs_of_another_format_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("organphys_bench.runs.run_file.FORMAT", 0)
    write_run(KEY.path(tmp_path), KEY, {"failure": ""})
    monkeypatch.undo()
    with pytest.raises(InputError, match="another version"):
        read_runs(tmp_path)
