"""organphys follow and organphys map --frame; the inputs of a sequence."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from organphys.asset.sequence_file import load_sequence
from organphys.ground.checks import InputError
from organphys.pipeline.command_line import main
from organphys.pipeline.evaluation import mean_by_region, read_truth
from organphys.pipeline.sample_case import write_sample_case
from organphys.pipeline.sequence_inputs import frame_times, natural_key, splat_files


def touch(folder, *names):
    for name in names:
        (folder / name).write_bytes(b"")


def test_files_are_sorted_as_people_count(tmp_path):
    assert natural_key(Path("\u00b25.ply")) < natural_key(Path("7.ply"))  # a raised 2 is no number to count by
    touch(tmp_path, "t_10.ply", "t_2.ply", "T_1.PLY", "notes.txt")
    assert [path.name for path in splat_files(str(tmp_path))] == ["T_1.PLY", "t_2.ply", "t_10.ply"]
    assert [path.name for path in splat_files(str(tmp_path / "t_*.ply"))] == ["t_2.ply", "t_10.ply"]
    (tmp_path / "notes.txt").write_text("# in this order\nt_10.ply\n\nt_2.ply\n")
    assert [path.name for path in splat_files(str(tmp_path / "notes.txt"))] == ["t_10.ply", "t_2.ply"]


def test_what_is_no_sequence_is_told(tmp_path):
    touch(tmp_path, "one.ply")
    (tmp_path / "list.txt").write_text("one.ply\ntwo.ply\n")
    (tmp_path / "odd.txt").write_text("one.ply\n" + "x" * 300 + ".ply\n")  # a name too long for a file
    sources = (tmp_path, "found 1"), (tmp_path / "x_*.ply", "found 0"), (tmp_path / "list.txt", "missing")
    for source, words in (*sources, (tmp_path / "odd.txt", "1 of its 2 files are missing")):
        with pytest.raises(InputError, match=words):
            splat_files(str(source))


def test_times(tmp_path):
    np.testing.assert_allclose(frame_times(3, fps=10)[0], [0, 0.1, 0.2])
    assert frame_times(3)[1] == "frame" and frame_times(3, fps=10)[1] == "s"
    file = tmp_path / "times.txt"
    file.write_text("0.5\n0.7\n1.0\n")
    np.testing.assert_allclose(frame_times(3, file=str(file))[0], [0.5, 0.7, 1.0])
    for count, words in ((2, "expected 2"), (4, "expected 4")):
        with pytest.raises(InputError, match=words):
            frame_times(count, file=str(file))
    for text, words in (
        ("0.5\nlater\n1.0", "seconds per line"),
        ("0\n1_0\n20", "seconds per"),
        ("-1e308\n0\n1e308", "3"),
    ):
        file.write_text(text)
        with pytest.raises(InputError, match=words):
            frame_times(3, file=str(file))
    with pytest.raises(InputError, match="one of them"):
        frame_times(3, fps=10, file=str(file))
    with pytest.raises(InputError, match="fps"):
        frame_times(3, fps=0)


def test_follow_and_map_a_frame(tmp_path, capsys):
    case = write_sample_case(tmp_path / "case", seed=5, size="small")
    frames = tmp_path / "frames.txt"
    frames.write_text(f"{case.splat}\n{case.splat}\n")
    out = tmp_path / "out"
    inputs = ["--labels", str(case.labels), "--organ", str(case.organ), "--landmarks", str(case.landmarks)]
    assert main(["follow", *inputs, "--splats", str(frames), "--fps", "25", "--out", str(out)]) == 0
    assert {path.name for path in out.iterdir()} == {"organ.organphys-seq", "sequence.json", "report.html"}
    assert "2 frames" in capsys.readouterr().out
    sequence = load_sequence(out / "organ.organphys-seq")
    assert sequence.status == ("first", "tracked") and sequence.times.tolist() == [0.0, 0.04]
    assert [frame["status"] for frame in json.loads((out / "sequence.json").read_text())["frames"]] == [
        "first",
        "tracked",
    ]
    report = (out / "report.html").read_text()
    assert report.count("<svg") == 3 and "src=" not in report  # curves, two frames; nothing is loaded from elsewhere
    truth = read_truth(case.truth)
    np.save(tmp_path / "points.npy", truth.points_ct)
    asset = str(out / "organ.organphys-seq")
    mapped = ["--points", str(tmp_path / "points.npy"), "--out", str(tmp_path / "mapped.npy")]
    errors = []
    for frame in ("0", "1"):
        assert main(["map", asset, "--frame", frame, *mapped]) == 0
        errors.append(mean_by_region(truth, np.load(tmp_path / "mapped.npy"))["all"])
    assert errors[1] < errors[0] + 0.5  # mm: the same splat again
    for wrong in (["map", asset, *mapped], ["map", asset, "--frame", "2", *mapped]):
        assert main(wrong) == 2
    assert "--frame" in capsys.readouterr().err
    assert main(["follow", *inputs, "--splats", str(tmp_path), "--out", str(tmp_path / "no")]) == 2
    assert not (tmp_path / "no").exists()
