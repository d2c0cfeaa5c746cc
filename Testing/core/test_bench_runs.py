"""The benchmark's runs: what is run, what is kept, under which conditions."""

import json
from types import SimpleNamespace

import numpy as np
import pytest
from bench_examples import KEY

from organphys.ground.checks import InputError
from organphys_bench import command_line
from organphys_bench.runs.case_folders import case_folders
from organphys_bench.runs.conditions import SWEEPS, Condition, full_conditions
from organphys_bench.runs.pool import groups, run_all, run_group
from organphys_bench.runs.run_file import RunKey, read_runs, write_run


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


def noted(asked):
    """In place of ``run_group``: notes the runs it is asked for."""
    return lambda group, *_: asked.extend(group) or dict.fromkeys(group, "done")


def test_what_has_run_is_not_run_again(finished, monkeypatch):
    said, asked = [], []
    monkeypatch.setattr("organphys_bench.runs.pool.run_group", noted(asked))
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
    assert "ValueError: no" in run_group([KEY], tmp_path, tmp_path)[KEY]
    assert json.loads(path.read_text(encoding="utf-8"))["failure"] == "ValueError: no"
    path.unlink()
    ended.returncode = -2
    assert run_group([KEY], tmp_path, tmp_path) == {KEY: "killed, not written down"}
    assert not path.exists()


def test_a_method_that_dies_takes_no_neighbour_with_it(tmp_path, monkeypatch):
    keys = [RunKey("tiny", method, Condition("noise", 0.3, 0)) for method in ("rigid_icp", "amberg", "organphys")]

    def process(command, **_):
        for method in command[-3].split(","):
            if method == "amberg":
                return SimpleNamespace(returncode=1, stderr="MemoryError\n")
            key = RunKey("tiny", method, Condition("noise", 0.3, 0))
            write_run(key.path(tmp_path), key, {"failure": ""})
        return SimpleNamespace(returncode=0, stderr="")

    monkeypatch.setattr("organphys_bench.runs.pool.subprocess.run", process)
    monkeypatch.setattr("organphys_bench.runs.run_file.commit", lambda: "none")
    words = run_group(keys, tmp_path, tmp_path)
    assert [words[key] for key in keys] == ["done", "failed, MemoryError", "done"]


def test_runs_of_one_condition_share_a_process_and_those_of_the_baseline_do_not(finished, tmp_path):
    keys = [
        RunKey("tiny", method, condition)
        for condition in (Condition(), Condition("noise", 0.3, 0), Condition("noise", 0.6, 0))
        for method in ("rigid_icp", "similarity_icp")
    ]
    assert [len(group) for group in groups(keys)] == [1, 1, 2, 2]
    words = run_group(keys[2:4], finished[0] / "tiny", tmp_path)
    assert set(words.values()) == {"done"}
    run = read_runs(tmp_path)[0]
    assert run["figures"]["ratio_to_oracle"] > 0
    assert "seconds" not in run


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


def test_the_sweeps_run_quick_methods_before_slow_ones_and_these_with_fewer_seeds():
    methods = ("rigid_icp", "coherent_drift", "organphys")
    keys = plan("--methods", "", "--full", "--sweeps", "landmarks", "--sweep-methods", ",".join(methods))
    levels = len(SWEEPS["landmarks"].levels)
    assert [key.method for key in keys[: 4 * levels : 2]] == ["rigid_icp"] * 2 * levels
    assert {key.method for key in keys[4 * levels : 6 * levels]} == {"coherent_drift"}
    assert [sum(key.method == method for key in keys) for method in methods] == [20 * levels, 6 * levels, 20 * levels]
    assert [len(group) for group in groups(keys)[: 3 * levels]] == [2] * 2 * levels + [1] * levels


def test_the_plan_can_be_a_part_of_it():
    keys = plan("--methods", "", "--full", "--sweeps", "landmarks", "--sweep-cases", "b")
    assert {(key.case, key.condition.sweep) for key in keys} == {("b", "landmarks")}
    assert {key.case for key in plan("--only", "a", "--full")} == {"a"}
    assert {key.condition.seed for key in plan("--full", "--seeds", "2")} == {0, 1}
    for arguments, word in (("--methods", "method"), ("--only", "case"), ("--sweep-cases", "case")):
        with pytest.raises(InputError, match=f"no {word} magic"):
            plan(arguments, "magic", "--full")
    with pytest.raises(InputError, match="no sweep magic"):
        plan("--sweeps", "magic", "--full")


def test_no_run_begins_when_the_minutes_are_over(tmp_path, monkeypatch):
    said, asked = [], []
    monkeypatch.setattr("organphys_bench.runs.pool.run_group", noted(asked))
    run_all([KEY], {"tiny": tmp_path}, tmp_path, jobs=1, minutes=-1.0, tell=said.append)
    assert asked == []
    assert said == ["1 runs are left for another time: -1 minutes are over"]
    run_all([KEY], {"tiny": tmp_path}, tmp_path, jobs=1, minutes=5.0, tell=said.append)
    assert asked == [KEY]


def test_runs_of_another_format_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("organphys_bench.runs.run_file.FORMAT", 0)
    write_run(KEY.path(tmp_path), KEY, {"failure": ""})
    monkeypatch.undo()
    with pytest.raises(InputError, match="another version"):
        read_runs(tmp_path)
