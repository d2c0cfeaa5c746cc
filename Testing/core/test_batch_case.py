"""One case of a batch: skipped where it is finished, whole or absent after any end, never done by two at once."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from batch_examples import FILE, cheap_case, noted, write_table
from threadpoolctl import threadpool_info

from organphys.ground.checks import InputError
from organphys.pipeline.batch_case import work_case
from organphys.pipeline.batch_folder import RECORD, CaseFolder
from organphys.pipeline.batch_lock import case_lock
from organphys.pipeline.batch_records import BUSY, DONE, FAILED, KEPT, BatchCase
from organphys.pipeline.batch_table import read_batch

POSIX = pytest.mark.skipif(os.name == "nt", reason="processes are killed the POSIX way")


def one_case(folder: Path, **row: object) -> BatchCase:
    return read_batch(write_table(folder, [{"case": "a", **row}]))[0]


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def test_done_once_then_kept(tmp_path: Path) -> None:
    case, out = one_case(tmp_path), tmp_path / "out"
    first, second = work_case(case, out, cheap_case), work_case(case, out, cheap_case)
    assert (first.status, second.status) == (DONE, KEPT)
    assert first.result == second.result == {"verdict": "trust", "error [mm]": 1.5}
    assert first.seconds == second.seconds and first.seconds > 0
    assert names(out / "a") == {FILE, RECORD} and len(noted(tmp_path, "begin")) == 1
    assert names(out / ".batch") == {"a.lock"}


@pytest.mark.parametrize("change", ["input", "setting", "lost", "damaged", "record"])
def test_what_is_not_finished_or_of_other_inputs_is_done_again(tmp_path: Path, change: str) -> None:
    case, out = one_case(tmp_path), tmp_path / "out"
    work_case(case, out, cheap_case)
    if change == "input":
        (tmp_path / "splat.ply").write_text("another splat")
    elif change == "setting":
        case = one_case(tmp_path, fov="50")
    elif change == "lost":
        (out / "a" / FILE).unlink()
    elif change == "damaged":
        (out / "a" / FILE).write_text("half of i")
    else:
        (out / "a" / RECORD).write_text("{}")
        (out / "a" / FILE).unlink()
    assert work_case(case, out, cheap_case).status == DONE
    assert (out / "a" / FILE).read_text() == "half of it" and work_case(case, out, cheap_case).status == KEPT
    assert names(out / ".batch") == {"a.lock"}


@pytest.mark.parametrize(
    ("seed", "message"),
    [(1, "organ: nothing there; take another label"), (2, "error of the program, RuntimeError: a bug; see ")],
)
def test_failures_are_one_line_with_the_traceback_aside(tmp_path: Path, seed: int, message: str) -> None:
    case, out = one_case(tmp_path, seed=seed), tmp_path / "out"
    outcome = work_case(case, out, cheap_case)
    assert outcome.status == FAILED and outcome.error.startswith(message) and "\n" not in outcome.error
    assert "Traceback" in (out / "errors" / "a.txt").read_text()
    assert not (out / "a").exists() and names(out / ".batch") == {"a.lock"}


def test_a_failure_keeps_older_results_and_success_removes_the_error(tmp_path: Path) -> None:
    out = tmp_path / "out"
    work_case(one_case(tmp_path), out, cheap_case)
    assert work_case(one_case(tmp_path, seed=1), out, cheap_case).status == FAILED
    assert names(out / "a") == {FILE, RECORD}
    assert work_case(one_case(tmp_path), out, cheap_case).status == KEPT
    (out / "a" / FILE).unlink()
    assert work_case(one_case(tmp_path), out, cheap_case).status == DONE
    assert not (out / "errors" / "a.txt").exists()


def test_a_missing_input_is_a_failure_of_its_case(tmp_path: Path) -> None:
    case = one_case(tmp_path)
    (tmp_path / "splat.ply").unlink()

    def reads(arguments: object, folder: Path) -> dict[str, object]:
        return {"size": (tmp_path / "splat.ply").stat().st_size}

    outcome = work_case(case, tmp_path / "out", reads)
    assert outcome.status == FAILED and "splat.ply: No such file" in outcome.error


def test_files_of_someone_else_are_never_removed(tmp_path: Path) -> None:
    case, out = one_case(tmp_path), tmp_path / "out"
    (out / "a").mkdir(parents=True)
    (out / "a" / "notes.txt").write_text("mine")
    outcome = work_case(case, out, cheap_case)
    assert outcome.status == FAILED and "holds what no batch has written (notes.txt)" in outcome.error
    assert names(out / "a") == {"notes.txt"} and not noted(tmp_path, "begin")
    (out / "a" / "notes.txt").rename(out / "a" / ".DS_Store")  # what a desktop leaves is no one's work
    assert work_case(case, out, cheap_case).status == DONE


def test_a_file_in_the_place_of_the_folder_is_kept(tmp_path: Path) -> None:
    case, out = one_case(tmp_path), tmp_path / "out"
    out.mkdir()
    (out / "a").write_text("mine")
    assert work_case(case, out, cheap_case).status == FAILED and (out / "a").read_text() == "mine"


def test_one_thread_for_blas(tmp_path: Path) -> None:
    def threads(arguments: object, folder: Path) -> dict[str, object]:
        return {"threads": max(pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas")}

    assert work_case(one_case(tmp_path), tmp_path / "out", threads).result == {"threads": 1}


def test_a_held_case_is_left_or_waited_for(tmp_path: Path) -> None:
    case, out = one_case(tmp_path), tmp_path / "out"
    with case_lock(CaseFolder(out, "a").lock, wait=False) as held:
        assert held
        assert work_case(case, out, cheap_case).status == BUSY
        waiting = threading.Thread(target=work_case, args=(case, out, cheap_case), kwargs={"wait": True})
        waiting.start()
        time.sleep(0.3)
        assert not noted(tmp_path, "begin")
    waiting.join(timeout=30)
    assert [organ for organ, _ in noted(tmp_path, "end")] == ["5"]


def test_many_at_once_do_it_once(tmp_path: Path) -> None:
    case, out, found = one_case(tmp_path), tmp_path / "out", []
    workers = [
        threading.Thread(target=lambda: found.append(work_case(case, out, cheap_case, wait=True).status))
        for _ in range(6)
    ]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join(timeout=30)
    assert sorted(found) == [DONE, *[KEPT] * 5] and len(noted(tmp_path, "begin")) == 1


def test_an_interrupted_exchange_is_undone(tmp_path: Path) -> None:
    """Killed after the older results moved aside and before the new ones came."""
    case, out = one_case(tmp_path), tmp_path / "out"
    work_case(case, out, cheap_case)
    folder = CaseFolder(out, "a")
    os.rename(folder.place, folder.old)
    assert work_case(case, out, cheap_case).status == KEPT
    assert names(out / ".batch") == {"a.lock"}


def test_locks_that_the_file_system_refuses(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fcntl = pytest.importorskip("fcntl")

    def refused(handle: int, operation: int) -> None:
        raise OSError(37, "No locks available")

    monkeypatch.setattr(fcntl, "flock", refused)
    with pytest.raises(InputError, match="cannot be locked"), case_lock(tmp_path / "x.lock", wait=False):
        pass


@POSIX
def test_killed_at_any_moment_it_is_whole_or_absent(tmp_path: Path) -> None:
    """In a process of its own, which forks: another one of these that does the case over and over dies 40 times."""
    program = "import batch_examples, sys; batch_examples.kill_trials(sys.argv[1], 40)"
    command = [sys.executable, "-c", program, str(tmp_path)]
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parent)}
    told = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=120)
    assert told.returncode == 0, told.stderr
    seen = set(told.stdout.split())
    assert seen <= {"whole", "absent"} and "whole" in seen
    assert work_case(one_case(tmp_path), tmp_path / "out", cheap_case).status == DONE
    assert names(tmp_path / "out" / ".batch") == {"a.lock"}
