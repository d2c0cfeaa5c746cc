"""The table of a batch: read as a whole, every error told by its line before anything runs."""

from __future__ import annotations

from pathlib import Path

import pytest
from batch_examples import write_table

from organphys.ground.checks import InputError
from organphys.pipeline.batch_table import read_batch
from organphys.pipeline.command_line import main

HEAD = "case,labels,organ,splat"
ROW = "a,ct.nii.gz,5,splat.ply"


def table(folder: Path, text: str | bytes) -> Path:
    write_table(folder, [])
    (folder / "cases.csv").write_bytes(text.encode() if isinstance(text, str) else text)
    return folder / "cases.csv"


def test_cells_become_the_options_of_register(tmp_path: Path) -> None:
    rows = [
        {"case": "a"},
        {"case": "B 2", "landmarks": "-1,2,3;4,5,6", "camera": "-1e-3 0 2", "clean": "Yes", "no_opening": "0"},
        {"case": "c", "seed": 7, "mm_per_unit": "25:5", "organ": "liver", "label_scheme": "totalsegmentator"},
    ]
    first, second, third = read_batch(write_table(tmp_path, rows))
    assert [case.line for case in (first, second, third)] == [2, 3, 4]
    assert first.arguments.labels == str(tmp_path / "ct.nii.gz") and first.arguments.opacity == 0.1
    assert second.arguments.landmarks == "-1,2,3;4,5,6" and second.arguments.camera == [-0.001, 0.0, 2.0]
    assert second.arguments.clean is True and second.arguments.no_opening is False
    assert (third.arguments.seed, third.arguments.mm_per_unit, third.arguments.organ) == (7, "25:5", "liver")
    assert third.name == "c" and third.arguments.camera == [0.0, 0.0, 0.0]


@pytest.mark.parametrize("mark", [";", "\t"])
def test_other_separators_byte_order_mark_and_empty_lines(tmp_path: Path, mark: str) -> None:
    text = f"{HEAD}\n\n{ROW}\n\n\nb,ct.nii.gz,5,splat.ply\n".replace(",", mark).replace("\n", "\r\n")
    cases = read_batch(table(tmp_path, b"\xef\xbb\xbf" + text.encode()))
    assert [(case.name, case.line) for case in cases] == [("a", 3), ("b", 6)]


def test_lines_are_counted_through_cells_with_line_breaks(tmp_path: Path) -> None:
    text = f'{HEAD},landmarks\n{ROW},"1,2,3;\n4,5,6"\nb,ct.nii.gz,5,none.ply,\n'
    with pytest.raises(InputError, match=r"line 4: splat: .*none\.ply: no such file"):
        read_batch(table(tmp_path, text))


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "is empty"),
        (HEAD, "no case below the header"),
        ("case,labels,organ\na,ct.nii.gz,5", "line 1: column 'splat' missing"),
        (f"{HEAD},sead\n{ROW},1", "line 1: column 'sead' unknown; the columns are case, labels"),
        (f"{HEAD},seed,--seed\n{ROW},1,1", "line 1: column 'seed' given twice"),
        (f"{HEAD},out\n{ROW},x", "column 'out' unknown"),
        (f"{HEAD}\n{ROW},1,2,3", "line 2: 7 cells under 4 columns"),
        (f"{HEAD},landmarks\n{ROW},1,2,3", "put quotes about a cell"),
        (f'{HEAD}\n{ROW}\n"b,ct.nii.gz,5,splat.ply', "line 3: unexpected end of data"),
        (f"{HEAD}\n,ct.nii.gz,5,splat.ply", "line 2: case: expected a name"),
        (f"{HEAD}\n../a,ct.nii.gz,5,splat.ply", "line 2: case: expected a name"),
        (f"{HEAD}\nerrors,ct.nii.gz,5,splat.ply", "line 2: case: expected a name"),
        (f"{HEAD}\na,ct.nii.gz,,splat.ply", "line 2: the following arguments are required: --organ"),
        (f"{HEAD}\na,none.nii.gz,5,splat.ply", "line 2: labels: .*none.nii.gz: no such file"),
        (f"{HEAD}\n{ROW}\nb,ct.nii.gz,5,splat.ply\nA,ct.nii.gz,5,splat.ply", "line 4: case 'A' is also on line 2"),
        (f"{HEAD},seed\n{ROW},x", "line 2: --seed: invalid int value"),
        (f"{HEAD},method\n{ROW},magic", "line 2: --method: invalid choice"),
        (f"{HEAD},method\n{ROW},paper", "line 2: method paper needs landmarks"),
        (f"{HEAD},opacity\n{ROW},1.5", "line 2: --opacity"),
        (f"{HEAD},fov\n{ROW},200", "line 2: field of view"),
        (f"{HEAD},mm_per_unit\n{ROW},thirty", "line 2: --mm-per-unit: expected S or S:P"),
        (f"{HEAD},camera\n{ROW},1 2", "line 2: camera"),
        (f"{HEAD},camera\n{ROW},1 2 x", "line 2: camera: expected three numbers"),
        (f"{HEAD},clean\n{ROW},maybe", "line 2: clean: expected yes or no"),
        (f"{HEAD},landmarks\n{ROW},none.mrk.json", "line 2: .*none.mrk.json: no such file"),
        (f"{HEAD},roi\n{ROW},none.json", "line 2: .*none.json"),
        (b"\xff\xfe" + HEAD.encode("utf-16-le"), "not UTF-8"),
        (HEAD.encode() + b"\n" + b"\x00,ct.nii.gz,5,splat.ply", "line 2"),
    ],
)
def test_errors_name_the_line_and_the_remedy(tmp_path: Path, text: str | bytes, says: str) -> None:
    with pytest.raises(InputError, match=says):
        read_batch(table(tmp_path, text))


def test_all_lines_are_checked_before_anything_runs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = [{"case": f"c{k}", "seed": "x" if k % 2 else "1"} for k in range(30)]
    path, out = write_table(tmp_path, rows), tmp_path / "out"
    assert main(["batch", str(path), "--out", str(out)]) == 2
    told = capsys.readouterr().err
    assert told.count("\n") == 1 and told.count("; line ") == 10 and "and 5 more" in told
    assert "line 3:" in told and "line 2:" not in told and "nothing was run" in told
    assert not out.exists()


def test_what_is_no_table(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        read_batch(tmp_path)
    (tmp_path / "big.csv").write_bytes(b"a" * 20_000_001)
    with pytest.raises(InputError, match="larger than 20 MB"):
        read_batch(tmp_path / "big.csv")
