"""Faults while results are written: a few of each kind. Many, at random moments: make faults (Testing/faults)."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

if sys.platform != "linux":
    pytest.skip("faults are put in the Linux way", allow_module_level=True)

sys.path.append(str(Path(__file__).resolve().parents[1] / "faults"))

from commands import Commands
from injected import Fault
from outputs import FOREIGN, OLDER, write_older
from trial import Ended, Size, judged, measured, run_trial

from organphys.ground import hidden_folder
from organphys.ground.atomic_file import atomic_path, write_bytes, write_text
from organphys.ground.checks import InputError
from organphys.pipeline import command_line, output_folder
from organphys.pipeline.output_folder import whole_or_nothing

FAULTS = Path(__file__).resolve().parents[1] / "faults"
NAMES = ("export", "frames")  # register and simulate take longer: they are in the campaign


@pytest.fixture(scope="module")
def commands(tmp_path_factory: pytest.TempPathFactory) -> Commands:
    made = Commands(tmp_path_factory.mktemp("commands"))
    for name in NAMES:
        made.compute(name)
    return made


@pytest.fixture(scope="module")
def sizes(commands: Commands) -> dict[str, Size]:
    places = {name: commands.folder / f"size_{name}" for name in NAMES}
    for place in places.values():
        place.mkdir()
    return {name: measured(commands, name, place) for name, place in places.items()}


def moments(size: Size, count: int) -> list[int]:
    """Event numbers spread over a run, its last ones among them."""
    return sorted({*range(1, size.events, max(1, size.events // count)), size.events - 1, size.events})


@pytest.mark.parametrize(
    ("name", "kind", "count"),
    [
        ("export", "kill", 6), ("frames", "kill", 3), ("export", "full", 3), ("frames", "full", 3),
        ("frames", "interrupt", 2), ("export", "interrupt", 3), ("frames", "two at once", 1),
        ("export", "two at once", 1),
    ],
)  # fmt: skip
def test_a_fault_at_an_event(
    commands: Commands, sizes: dict[str, Size], tmp_path: Path, name: str, kind: str, count: int
) -> None:
    ends = set()
    for number in moments(sizes[name], count):
        for older in (False, True) if kind == "kill" else (True,):
            place = tmp_path / f"{number}{older}"
            place.mkdir()
            verdict = run_trial(commands, sizes[name].names, name, Fault(kind, number), place, older=older)
            assert verdict.failure == "", (number, older)
            ends.add(verdict.ended)
    assert ends & {"killed", "told", "stopped"} or kind == "two at once"


@pytest.mark.parametrize("kind", ["half", "large"])
@pytest.mark.parametrize("name", NAMES)
def test_a_write_that_stops_in_a_file(
    commands: Commands, sizes: dict[str, Size], tmp_path: Path, name: str, kind: str
) -> None:
    """Native writers too: the limit is the system's."""
    fault = Fault(kind, sizes[name].largest // 2)
    verdict = run_trial(commands, sizes[name].names, name, fault, tmp_path, older=True)
    assert verdict == type(verdict)("killed" if kind == "half" else "told", "older")


def test_little_memory(tmp_path: Path) -> None:
    """Left for a whole command, computing included: told in one line, the older results stay."""
    command = [sys.executable, str(FAULTS / "little_memory.py"), str(tmp_path), "0.3", "3", "10"]
    found = subprocess.run(command, capture_output=True, text=True, check=True)
    assert [line.split() for line in found.stdout.splitlines()] == [["told", "older"]] * 3, found.stdout


def test_the_harness_sees_debris_mixtures_and_tracebacks() -> None:
    fault = Fault("kill", 1)
    for left in ("between", "older and new side by side", "x.json: ValueError"):
        assert judged(Ended(-9, ""), fault, left, False, set()).failure
    assert not judged(Ended(-9, ""), fault, "between", True, set()).failure
    assert judged(Ended(0, ""), fault, "new", False, {".x.0.part/"}).failure
    assert judged(Ended(2, "Traceback\nOSError: x"), fault, "absent", False, set()).failure
    assert not judged(Ended(2, "organphys: error: x"), fault, "absent", False, set()).failure


def test_a_folder_that_is_there_gets_all_files_or_is_finished_by_the_next_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The disk refuses to move the second file: the results are kept whole, and told so."""
    out, replace = tmp_path / "out", os.replace
    write_older(out, {"a", "b"})

    def refused(source: Path, target: Path) -> None:
        if Path(source).name == "b" and Path(target).parent == out:
            raise OSError(5, "Input/output error")
        replace(source, target)

    with monkeypatch.context() as patch:
        patch.setattr(output_folder.os, "replace", refused)
        with (
            pytest.raises(InputError, match=r"whole in .* next run into the folder moves them"),
            whole_or_nothing(out) as stage,
        ):
            for name in "ab":
                (stage / name).write_text("new")
    assert not (out / "b").exists()
    with pytest.raises(KeyError), whole_or_nothing(out):
        assert [(out / name).read_text() for name in "ab"] == ["new", "new"]
        raise KeyError
    assert {path.name: path.read_text() for path in out.iterdir()} == {"a": "new", "b": "new", FOREIGN: OLDER}


def test_a_folder_with_the_name_of_a_result_is_told_and_nothing_is_lost(tmp_path: Path) -> None:
    out = tmp_path / "out"
    (out / "b").mkdir(parents=True)
    (out / "a").write_text("old")
    with pytest.raises(InputError, match="it holds a folder b"), whole_or_nothing(out) as stage:
        for name in "ab":
            (stage / name).write_text("new")
    assert (out / "a").read_text() == "old" and {path.name for path in out.iterdir()} == {"a", "b"}


def test_a_second_run_into_the_same_folder_is_refused(tmp_path: Path) -> None:
    for there in (False, True):
        with whole_or_nothing(tmp_path / "out") as stage:
            (stage / "a").write_text("first")
            with pytest.raises(InputError, match="another run is writing into it"), whole_or_nothing(tmp_path / "out"):
                pass
        assert [path.name for path in tmp_path.iterdir()] == ["out"], there
    assert (tmp_path / "out" / "a").read_text() == "first"


@pytest.fixture
def no_locks(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    def refused(handle: int) -> bool:
        raise OSError(37, "No locks available")

    monkeypatch.setattr(hidden_folder, "try_lock", refused)
    yield


def test_where_the_file_system_has_no_locks(tmp_path: Path, no_locks: None) -> None:
    """Files are written beside what a dead writer left; of a folder it cannot be told who writes it."""
    (tmp_path / ".a.0.part").mkdir()
    write_text(tmp_path / "a", "new")
    assert (tmp_path / "a").read_text() == "new" and (tmp_path / ".a.0.part").exists()
    with whole_or_nothing(tmp_path / "out") as stage:
        (stage / "b").write_text("b")
    assert (tmp_path / "out" / "b").exists()
    (tmp_path / "out" / ".organphys").mkdir()
    with pytest.raises(InputError, match="if none runs, delete"), whole_or_nothing(tmp_path / "out"):
        pass


def test_errors_of_other_files_keep_their_names(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="missing"), atomic_path(tmp_path / "deep" / "a"):
        (tmp_path / "missing").read_bytes()
    assert list(tmp_path.iterdir()) == []  # the folder made for it is gone too


def test_a_full_disk_without_a_file_name_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"a: cannot be written .*make room"), atomic_path(tmp_path / "a"):
        raise OSError(28, "No space left on device")
    assert list(tmp_path.iterdir()) == []


def test_ctrl_c_at_the_last_words_tells_the_truth(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "points.npy"

    def run(arguments: object) -> None:
        write_bytes(out, b"x")
        raise KeyboardInterrupt

    monkeypatch.setattr(command_line, "import_module", lambda *_: type("Module", (), {"run": staticmethod(run)}))
    argv = ["map", "asset", "--points", "p.csv", "--out", str(out)]
    assert command_line.main(argv) == 130
    assert "all results are written" in capsys.readouterr().err
