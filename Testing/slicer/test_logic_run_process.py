"""The client of the registration process: answers, cancelling, death, nonsense, and nothing left behind."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import qt

from OrganPhysRegistrationLib.runs import child_process, child_program, run_process
from OrganPhysRegistrationLib.runs.line_buffer import LONGEST_LINE, LineBuffer, LineTooLong
from OrganPhysRegistrationLib.runs.run_process import RunProcess

FAKE = Path(__file__).with_name("fake_server.py")


@pytest.fixture
def process() -> Iterator[RunProcess]:
    client = RunProcess(lambda folder: [str(FAKE)])
    yield client
    client.stop()


@pytest.fixture
def ask(host: object, process: RunProcess) -> Callable[..., dict]:
    """Send a request, wait for its last event and return it."""

    def ask(do: str, **fields: object) -> dict:
        events: list[dict] = []
        process.request(do, events.append, **fields)
        host.wait_until(lambda: not process.busy, timeout=20)
        return events[-1]

    return ask


def alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    status = Path(f"/proc/{pid}/stat")
    return not status.exists() or status.read_text().rsplit(")", 1)[1].split()[0] != "Z"


def test_lines_are_put_together_across_pieces_and_characters() -> None:
    lines, text = LineBuffer(), "Zürich\n\n  Bern \nGen"
    data = text.encode()
    found = [line for k in range(len(data)) for line in lines.feed(data[k : k + 1])]
    assert found == ["Zürich", "Bern"]
    assert lines.feed("ève\n".encode()) == ["Genève"]


def test_a_line_without_end_is_refused() -> None:
    with pytest.raises(LineTooLong):
        LineBuffer().feed(b"x" * (LONGEST_LINE + 1))


def test_answers_arrive_in_utf8_and_the_child_stays_warm(ask: Callable, process: RunProcess) -> None:
    assert ask("echo", word="Zürich")["echo"]["word"] == "Zürich"
    pid = process.ready["pid"]
    assert ask("echo", word="Bern")["echo"]["word"] == "Bern"
    assert process.running and process.ready["pid"] == pid and process.generation == 1


def test_progress_comes_before_the_end(host: object, process: RunProcess) -> None:
    events: list[dict] = []
    process.request("slow", events.append)
    host.wait_until(lambda: not process.busy, timeout=20)
    assert [event["event"] for event in events] == ["progress"] * 30 + ["done"]


def test_cancel_is_soft_where_the_child_obeys(host: object, process: RunProcess) -> None:
    events: list[dict] = []
    stopped: list[bool] = []
    process.request("slow", events.append)
    host.wait_until(lambda: len(events) > 3, timeout=20)
    pid = process.ready["pid"]
    process.cancel(lambda: stopped.append(True))
    host.wait_until(lambda: stopped, timeout=20)
    assert (events[-1]["event"], events[-1]["code"]) == ("failed", "cancelled")
    assert process.running and alive(pid)


def test_a_child_deaf_to_cancel_is_killed(host: object, process: RunProcess, monkeypatch: pytest.MonkeyPatch) -> None:
    events: list[dict] = []
    stopped: list[bool] = []
    folder = process.start()
    host.wait_until(lambda: process.ready, timeout=20)
    pid = process.ready["pid"]
    process.request("hang", events.append)
    process.cancel(lambda: stopped.append(True))
    host.wait_until(lambda: stopped, timeout=20)
    host.wait_until(lambda: not alive(pid), timeout=20)
    assert (events[-1]["event"], events[-1]["code"]) == ("failed", "cancelled")
    assert not process.running and not folder.exists()


def test_cancel_with_nothing_under_way_stops_at_once(process: RunProcess) -> None:
    stopped: list[bool] = []
    process.cancel(lambda: stopped.append(True))
    assert stopped


@pytest.mark.parametrize(
    ("do", "told"),
    [("crash", "no more memory"), ("garbage", "cannot be read"), ("endless", "a line of more than")],
)
def test_a_failing_child_is_told_and_started_again(ask: Callable, process: RunProcess, do: str, told: str) -> None:
    failed = ask(do)
    assert (failed["event"], failed["code"]) == ("failed", "internal")
    assert told in failed["message"] and "press Register" in failed["message"]
    assert not process.running
    assert ask("echo")["event"] == "done"
    assert process.generation == 2


def test_a_child_that_cannot_start_says_why(host: object) -> None:
    refusing, events = RunProcess(lambda folder: [str(FAKE), "--refuse"]), list[dict]()
    refusing.request("echo", events.append)
    host.wait_until(lambda: not refusing.busy, timeout=20)
    assert "could not start" in events[-1]["message"] and "No module named 'scipy'" in events[-1]["message"]


def test_a_program_that_does_not_exist_is_told(host: object, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(child_process, "python_program", lambda: "/no/such/PythonSlicer")
    process, events = RunProcess(lambda folder: []), list[dict]()
    process.request("echo", events.append)
    host.wait_until(lambda: not process.busy, timeout=20)
    assert "/no/such/PythonSlicer cannot be run" in events[-1]["message"]


def test_a_child_that_is_never_ready_is_given_up(host: object, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run_process, "START_MS", 200)
    process, events = RunProcess(lambda folder: ["-c", "import time; time.sleep(60)"]), list[dict]()
    process.request("echo", events.append)
    host.wait_until(lambda: not process.busy, timeout=20)
    assert "was not ready" in events[-1]["message"] and not process.running


def test_stop_ends_the_child_and_removes_its_folder(host: object, process: RunProcess) -> None:
    events: list[dict] = []
    folder = process.start()
    (folder / "points.npy").write_bytes(b"0")
    host.wait_until(lambda: process.ready, timeout=20)
    pid = process.ready["pid"]
    process.request("slow", events.append)
    process.stop()
    host.wait_until(lambda: not alive(pid), timeout=20)
    assert not folder.exists() and not process.running and not process.busy
    host.wait(0.1)
    assert not [event for event in events if event["event"] == "failed"]


def test_stderr_is_kept_to_its_last_lines(host: object) -> None:
    text = "import sys; [print(k, file=sys.stderr) for k in range(200)]; sys.exit(1)"
    ended: list[str] = []
    child = child_process.ChildProcess(lambda folder: ["-c", text], on_line=print, on_end=ended.append)
    host.wait_until(lambda: ended, timeout=20)
    assert child.error_text.splitlines() == [str(k) for k in range(150, 200)] and ended == ["199"]


def test_the_child_takes_the_modules_own_core(host: object, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also when another copy lies ahead on the path, as one installed by pip does in PythonSlicer."""
    (tmp_path / "organphys").mkdir()
    (tmp_path / "organphys" / "__init__.py").write_text("raise SystemExit('the wrong copy')")
    monkeypatch.setattr(child_program, "SERVER", "organphys.ground.checks")
    environment = qt.QProcessEnvironment.systemEnvironment()
    environment.insert("PYTHONPATH", str(tmp_path))
    monkeypatch.setattr(child_process, "server_environment", lambda: environment)
    ended: list[str] = []
    text = child_program.START + "; import organphys; print(organphys.__file__)"
    monkeypatch.setattr(child_program, "START", text)
    lines: list[str] = []
    child_process.ChildProcess(child_program.server_arguments, on_line=lines.append, on_end=ended.append)
    host.wait_until(lambda: ended, timeout=20)
    assert lines == [str(child_program.MODULE_FOLDER / "organphys" / "__init__.py")]


def test_waiting_for_the_child_does_not_block(host: object, process: RunProcess) -> None:
    began = time.monotonic()
    process.request("slow", lambda event: None)
    assert time.monotonic() - began < 1.0
    process.stop()
