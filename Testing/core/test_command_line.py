"""The command line: results, exit codes, one-line errors, and nothing half-written."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from organphys.asset.asset_file import load_asset
from organphys.pipeline.command_line import build_parser, main
from organphys.pipeline.commands_register import unit_of
from organphys.pipeline.sample_case import SampleCase, write_sample_case

RESULTS = {"organ.organphys", "registration.json", "surface.vtp", "report.html"}


@pytest.fixture(scope="module")
def case(tmp_path_factory: pytest.TempPathFactory) -> SampleCase:
    return write_sample_case(tmp_path_factory.mktemp("case"), seed=0, size="small")


@pytest.fixture(scope="module")
def result(case: SampleCase, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("result")
    assert main([*arguments(case), "--landmarks", str(case.landmarks), "--quiet", "--out", str(folder)]) == 0
    return folder


def arguments(case: SampleCase, **changes: str) -> list[str]:
    values = {"labels": str(case.labels), "organ": "5", "splat": str(case.splat)} | changes
    return ["register", *(part for name, value in values.items() for part in (f"--{name}", value))]


def fails(argv: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    """The one line that a command with exit code 2 prints."""
    try:
        code = main(argv)
    except SystemExit as leave:
        code = leave.code
    captured = capsys.readouterr()
    assert code == 2, captured.err
    assert captured.out == ""
    lines = [line for line in captured.err.splitlines() if not re.match(r"organphys: +[\d.]+ s ", line)]
    assert len(lines) == 1 and lines[0].startswith("organphys: error: "), captured.err
    return lines[0]


def test_register_writes_what_it_promises(result: Path) -> None:
    assert {path.name for path in result.iterdir()} == RESULTS
    record = json.loads((result / "registration.json").read_text())
    assert record["schema"] == 1 and record["method"] == "organphys"
    assert {"read", "coarse", "rigid", "basis", "elastic", "report", "total"} <= set(record["seconds"])
    assert record["seconds"]["read"] > 0
    assert record["scale_scene_per_mm"] > 0 and record["peak_memory_mb"] > 0
    assert {"coarse", "rigid", "elastic"} <= set(record["metrics"])
    assert all({"value", "unit"} == set(entry) for stage in record["metrics"].values() for entry in stage.values())
    assert all(set(warning) == {"code", "message"} for warning in record["warnings"])
    provenance = load_asset(result / "organ.organphys").provenance
    assert len(provenance["inputs"]["splat"]["sha256"]) == 64
    assert provenance["options"]["seed"] == 0


def test_record_holds_the_elastic_curve(result: Path) -> None:
    record = json.loads((result / "registration.json").read_text())
    alphas = [step["alpha"] for step in record["elastic_steps"]]
    assert alphas == sorted(alphas, reverse=True) and alphas[0] > alphas[-1]
    last, elastic = record["elastic_steps"][-1], record["metrics"]["elastic"]
    assert last["volume_drift_percent"] == pytest.approx(elastic["volume_drift"]["value"], abs=1e-6)
    assert last["min_det_f"] == pytest.approx(elastic["min_det_F"]["value"], abs=1e-9)
    assert record["seconds_per_elastic_step"] == pytest.approx(record["seconds"]["elastic"] / len(alphas))
    assert min(record["points"].values()) > 1000


def test_map_there_and_back(result: Path, tmp_path: Path) -> None:
    asset = str(result / "organ.organphys")
    points = load_asset(asset).vertices[::500]
    np.savetxt(tmp_path / "p.csv", points[:, [2, 0, 1]], delimiter=",", header="z,x,y", comments="", fmt="%.17g")
    np.save(tmp_path / "p.npy", points)
    for name in ("p.csv", "p.npy"):
        assert main(["map", asset, "--points", str(tmp_path / name), "--out", str(tmp_path / "q.npy"), "--quiet"]) == 0
        mapped = np.load(tmp_path / "q.npy")
        np.testing.assert_allclose(mapped, load_asset(asset).map_points(points), rtol=1e-12)
    there = ["map", asset, "--points", str(tmp_path / "q.npy"), "--out", str(tmp_path / "r.npy"), "--inverse"]
    assert main(there) == 0
    assert np.abs(np.load(tmp_path / "r.npy") - points).max() < 0.01


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("p.csv", b"", "no points"),
        ("p.csv", b"a,b,c\n1,2,3\n", "names no x, y and z"),
        ("p.csv", b"1,2,3\n1,2\n", "row 2"),
        ("p.csv", b"1,2,3,4\n", "three columns"),
        ("p.csv", b"1,2,nan\n", "not finite"),
        ("p.csv", b"x,y,z\n", "no points below"),
        ("p.csv", b"1;2;3\n", "separated by commas"),
        ("p.csv", b"1,2,1e300\n", "above 1e+12"),
        ("p.npy", b"\x93NUMPY\x01\x00garbage", "not a plain .npy"),
        ("p.txt", b"1,2,3\n", "unknown kind"),
    ],
)
def test_bad_points(
    result: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, content: bytes, says: str
) -> None:
    (tmp_path / name).write_bytes(content)
    argv = ["map", str(result / "organ.organphys"), "--points", str(tmp_path / name), "--out", str(tmp_path / "q.npy")]
    assert says in fails(argv, capsys)
    assert not (tmp_path / "q.npy").exists()


def test_pickled_points_are_refused(result: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    np.save(tmp_path / "p.npy", np.array([{"a": 1}], dtype=object), allow_pickle=True)
    argv = [
        "map",
        str(result / "organ.organphys"),
        "--points",
        str(tmp_path / "p.npy"),
        "--out",
        str(tmp_path / "q.npy"),
    ]
    assert "not a plain .npy" in fails(argv, capsys)


@pytest.mark.parametrize("array", [np.ones((2, 3), bool), np.ones((2, 3), complex), np.array([["a", "b", "c"]])])
def test_arrays_that_are_no_real_numbers_are_refused(
    result: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], array: np.ndarray
) -> None:
    np.save(tmp_path / "p.npy", array)
    argv = ["map", str(result / "organ.organphys"), "--points", str(tmp_path / "p.npy"), "--out"]
    assert "not real numbers" in fails([*argv, str(tmp_path / "q.npy")], capsys)


def test_map_tells_how_sure_each_point_is(result: Path, tmp_path: Path) -> None:
    organ = load_asset(str(result / "organ.organphys"))
    points = organ.vertices[::40]
    np.save(tmp_path / "p.npy", points)
    there = ["map", str(result / "organ.organphys"), "--points", str(tmp_path / "p.npy"), "--confidence"]
    assert main([*there, "--out", str(tmp_path / "q.npy"), "--quiet"]) == 0
    mapped = np.load(tmp_path / "q.npy")
    assert mapped.shape == (len(points), 5)
    assert (mapped[:, 3] > 0).all() and (mapped[:, 4] > mapped[:, 3]).all()
    np.testing.assert_allclose(mapped[:, 4], organ.error_radius(points, 0.95))
    np.save(tmp_path / "q.npy", mapped[:, :3])
    back = ["map", str(result / "organ.organphys"), "--points", str(tmp_path / "q.npy"), "--confidence", "--inverse"]
    assert main([*back, "--out", str(tmp_path / "r.npy"), "--quiet"]) == 0
    np.testing.assert_allclose(np.load(tmp_path / "r.npy")[:, 3:], mapped[:, 3:], rtol=0.02)


def test_a_single_point_far_away_maps_there_and_back(result: Path, tmp_path: Path) -> None:
    point, asset = np.array([[5000.0, 0.0, 0.0]]), str(result / "organ.organphys")
    np.save(tmp_path / "p.npy", point)
    assert main(["map", asset, "--points", str(tmp_path / "p.npy"), "--out", str(tmp_path / "q.npy")]) == 0
    back = ["map", asset, "--points", str(tmp_path / "q.npy"), "--out", str(tmp_path / "r.npy"), "--inverse"]
    assert main(back) == 0
    np.testing.assert_allclose(np.load(tmp_path / "r.npy"), point, atol=0.01)


def test_info(case: SampleCase, result: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for file, says in (
        (case.labels, "label 5"),
        (case.splat, "Gaussians"),
        (result / "organ.organphys", "scene units per mm"),
    ):
        assert main(["info", str(file)]) == 0
        assert says in capsys.readouterr().out
    assert main(["info", str(case.labels), "--label-scheme", "totalsegmentator"]) == 0
    assert "liver" in capsys.readouterr().out


def test_info_of_something_else(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "notes.txt").write_text("hello")
    (tmp_path / "broken.organphys").write_bytes(b"PK\x03\x04 not a zip")
    for name in ("notes.txt", "broken.organphys", "missing.nii.gz", "."):
        fails(["info", str(tmp_path / name)], capsys)


@pytest.mark.parametrize(
    ("extra", "says"),
    [
        (["--mm-per-unit", "thirty"], "S or S:P"),
        (["--mm-per-unit", "-3"], "above 0"),
        (["--opacity", "1.5"], "--opacity"),
        (["--fov", "200"], "field of view"),
        (["--seed", "-1"], "seed"),
        (["--method", "paper"], "landmarks"),
        (["--method", "magic"], "invalid choice"),
        (["--landmarks", "9000,0,0"], "mm"),
        (["--landmarks", "missing.mrk.json"], "no such file"),
        (["--roi", "missing.json"], "missing.json"),
        (["--camera", "1", "2"], "3 arguments"),
        (["--label-scheme", "nonsense"], "scheme"),
        (["--opacity", "0.9999"], "opacity"),
    ],
)
def test_errors_of_register(
    case: SampleCase, tmp_path: Path, capsys: pytest.CaptureFixture[str], extra: list[str], says: str
) -> None:
    out = tmp_path / "made" / "here"
    assert says in fails([*arguments(case), *extra, "--out", str(out)], capsys)
    assert not (tmp_path / "made").exists()


@pytest.mark.parametrize(
    ("name", "value"), [("labels", "missing.nii.gz"), ("splat", "missing.ply"), ("organ", "77"), ("organ", "spleen")]
)
def test_errors_of_inputs(
    case: SampleCase, tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, value: str
) -> None:
    fails([*arguments(case, **{name: value}), "--out", str(tmp_path / "out")], capsys)
    assert not (tmp_path / "out").exists()


def test_an_empty_roi_is_an_error(case: SampleCase, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "roi.json").write_text(json.dumps({"center": [0, 0, -100], "size": [1, 1, 1]}))
    fails([*arguments(case), "--roi", str(tmp_path / "roi.json"), "--out", str(tmp_path / "out")], capsys)


def test_a_folder_that_cannot_be_written_is_found_before_the_work(
    case: SampleCase, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("in the way")
    unreadable = arguments(case, splat="missing.ply")  # would be the error if the inputs were read first
    assert "cannot be written" in fails([*unreadable, "--out", str(tmp_path / "file" / "out")], capsys)
    assert (tmp_path / "file").read_text() == "in the way"


def test_a_failure_leaves_older_results(case: SampleCase, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "report.html").write_text("older")
    fails([*arguments(case, splat="missing.ply"), "--out", str(tmp_path)], capsys)
    assert [path.name for path in tmp_path.iterdir()] == ["report.html"]
    assert (tmp_path / "report.html").read_text() == "older"


def heed_ctrl_c() -> None:
    """A shell makes what it runs in the background, and all children of that, ignore Ctrl-C: these tests too."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


@pytest.mark.skipif(os.name == "nt", reason="signals are sent the POSIX way")
@pytest.mark.parametrize(
    ("stage", "number"), [("read", signal.SIGINT), ("coarse", signal.SIGTERM), ("elastic", signal.SIGINT)]
)
def test_ctrl_c_leaves_nothing(case: SampleCase, tmp_path: Path, stage: str, number: int) -> None:
    out = tmp_path / "out"
    command = [sys.executable, "-m", "organphys", *arguments(case), "--out", str(out)]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=heed_ctrl_c
    ) as process:
        assert process.stderr is not None
        for line in process.stderr:
            if line.rstrip().endswith(stage):
                process.send_signal(number)
                break
        rest = process.stderr.read()
        assert process.wait(timeout=60) == 130
    assert rest.splitlines()[-1] == "organphys: stopped, nothing was written"
    assert "Traceback" not in rest
    assert not out.exists()


@pytest.mark.skipif(os.name == "nt", reason="signals are sent the POSIX way")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_interrupts_wait_while_files_move(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int) -> None:
    from organphys.pipeline import output_folder

    replace, moved = os.replace, []

    def interrupted(source: Path, target: Path) -> None:
        os.kill(os.getpid(), number)
        moved.append(Path(target).name)
        replace(source, target)

    monkeypatch.setattr(output_folder.os, "replace", interrupted)
    (tmp_path / "out").mkdir()
    with output_folder.whole_or_nothing(tmp_path / "out") as stage:
        (stage / "a").write_text("a")
        (stage / "b").write_text("b")
    assert moved == ["a", "b"]
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"a", "b"}


def test_values_that_look_like_options() -> None:
    from organphys.pipeline.command_line import _with_negative_values

    argv = ["--labels", "a", "--organ", "1", "--splat", "b", "--out", "c"]
    extra = ["--landmarks", "-1.5,2,3;-4,5,6", "--camera", "-1e-3", "-2", "-.5"]
    parsed = build_parser().parse_args(_with_negative_values(["register", *argv, *extra]))
    assert parsed.landmarks == "-1.5,2,3;-4,5,6"
    assert parsed.camera == [-0.001, -2.0, -0.5]


def test_units() -> None:
    assert unit_of(None) is None
    exact, prior = unit_of("25"), unit_of("25:5")
    assert exact is not None and (exact.mm_per_unit, exact.percent) == (25.0, 0.0)
    assert prior is not None and (prior.mm_per_unit, prior.percent) == (25.0, 5.0)


def test_every_option_is_documented(capsys: pytest.CaptureFixture[str]) -> None:
    for command in ("register", "map", "info", "simulate", "export", "demo"):
        with pytest.raises(SystemExit) as leave:
            main([command, "--help"])
        assert leave.value.code == 0
        assert "--" in capsys.readouterr().out
        subparser = build_parser()._subparsers._group_actions[0].choices[command]  # type: ignore[union-attr]
        assert all(action.help for action in subparser._actions)


def test_help_names_every_label_scheme() -> None:
    from organphys.pipeline import command_options
    from organphys.readers.label_schemes import SCHEMES

    assert command_options.SCHEMES.split(", ") == list(SCHEMES)


def test_progress_off_a_terminal_is_one_line_per_stage(capsys: pytest.CaptureFixture[str]) -> None:
    from organphys.pipeline.terminal_progress import shown_progress

    with shown_progress(quiet=False) as progress:
        for stage, fraction in (("coarse", 0.0), ("coarse", 0.5), ("rigid", 0.0), ("rigid", 1.0)):
            progress(stage, fraction)
    assert [line.split()[-1] for line in capsys.readouterr().err.splitlines()] == ["coarse", "rigid"]
