"""One fault: a child process runs a command and meets it; then what lies there is judged, and the command run again."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import time
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from commands import FILES, Commands
from injected import Fault, arm, counter
from outputs import names_below, state, write_older

SLOWEST_S = 300.0
MOVED = "the next run into the folder moves them"
BUSY = "another run is writing"


@dataclass(frozen=True)
class Verdict:
    """``ended``: killed, done, told (an error in one line), stopped, died (of itself); ``failure``: empty if all is
    as it should be."""

    ended: str
    left: str
    failure: str = ""


@dataclass(frozen=True)
class Ended:
    """Exit code (negative: the signal) and what the command said on stderr."""

    code: int
    text: str


def run_trial(commands: Commands, names: set[str], name: str, fault: Fault, place: Path, *, older: bool) -> Verdict:
    """``names``: files of a whole output folder of this command; ``place``: an empty folder for this trial."""
    out = place / "out" / ("organ.vtp" if name in FILES else "results")
    out.parent.mkdir()
    if older:
        write_older(out, names)
    with _disk(fault, out.parent):
        if fault.kind == "two at once":
            return _two(commands, names, name, fault, out)
        ended = wait(start(commands, name, out, fault), fault)
        left = state(out, names)
        verdict = judged(ended, fault, left, older, names_below(out.parent))
    if verdict.failure:
        return verdict
    return Verdict(verdict.ended, left, _again(commands, names, name, out, older))


def _again(commands: Commands, names: set[str], name: str, out: Path, older: bool) -> str:
    """What is wrong after a second run without any fault."""
    ended = wait(start(commands, name, out, None), None)
    if ended.code != 0:
        return f"run again: exit code {ended.code}, {ended.text[-200:]}"
    left, hidden = state(out, names), [entry for entry in names_below(out.parent) if _is_hidden(entry)]
    if left != "new" or hidden:
        return f"run again: {left}, debris {sorted(hidden)}"
    return ""


def judged(ended: Ended, fault: Fault, left: str, older: bool, entries: set[str]) -> Verdict:
    """``entries``: all that lies in the folder of outputs and below."""
    before, debris = "older" if older else "absent", sorted(entry for entry in entries if _is_hidden(entry))
    lines = [line for line in ended.text.splitlines() if not re.match(r"organphys: +[\d.]+ s ", line)]
    if ended.code < 0:
        sent = {"kill": 9, "kill timed": 9, "half": signal.SIGXFSZ}.get(fault.kind)
        word = "killed" if -ended.code == sent else f"died of {signal.Signals(-ended.code).name}"
        allowed = {before, "new", *(["between"] if older else [])}
        wrong = "" if left in allowed and (word == "killed" or fault.kind.startswith("memory")) else f"{word}: {left}"
        return Verdict(word if word == "killed" else "died", left, wrong)
    if ended.code == 0:
        wrong = "" if left == "new" and not debris else f"exit code 0: {left}, debris {debris}"
        return Verdict("done", left, wrong)
    if ended.code == 130:
        said = "organphys: stopped, nothing was written" if left == before else "organphys: stopped, but all results"
        ok = left in (before, "new") and not debris and len(lines) == 1 and lines[0].startswith(said)
        return Verdict("stopped", left, "" if ok else f"stopped: {left}, debris {debris}, {lines[-3:]}")
    if MOVED in ended.text:  # the older results may be gone by then: the whole new ones are kept for the next run
        before, debris = left if left in ("older", "between") else before, []
    one = len(lines) == 1 and lines[0].startswith("organphys: error: ")
    ok = ended.code == 2 and one and left == before and not debris
    return Verdict("told", left, "" if ok else f"exit code {ended.code}: {left}, debris {debris}, {lines[-4:]}")


def start(commands: Commands, name: str, out: Path, fault: Fault | None) -> tuple[int, int]:
    """A child process with the command in it; its number, and a pipe with its stderr, which no file limit reaches."""
    source, sink = os.pipe()
    sys.stdout.flush()
    child = os.fork()
    if child:
        os.close(sink)
        return child, source
    code = 99
    try:
        os.dup2(sink, 2)
        sys.stderr = os.fdopen(2, "w", closefd=False)  # pytest has put another one there
        signal.signal(signal.SIGINT, signal.default_int_handler)
        whole = fault is not None and fault.kind in ("kill timed", "interrupt timed", "memory, whole")
        if fault is not None:
            arm(fault, out.parent)
        code = commands.call(name, out, real=whole)
    except SystemExit as leave:
        code = int(leave.code or 0)
    except BaseException:  # what Python would print before it ends
        code = 1
        traceback.print_exc()
    finally:
        sys.stderr.flush()
        os._exit(code)


def wait(child: tuple[int, int], fault: Fault | None) -> Ended:
    """Until the child ends; timed faults happen on the way."""
    number, pipe = child
    begin, send = time.monotonic(), _signal_of(fault)
    while True:
        done, status = os.waitpid(number, os.WNOHANG)
        if done:
            break
        if send is not None and fault is not None and _seconds(number) > fault.at:
            os.kill(number, send)
            send = None
        if time.monotonic() - begin > SLOWEST_S:
            os.kill(number, signal.SIGKILL)
            os.waitpid(number, 0)
            os.close(pipe)
            return Ended(1, f"hangs for {SLOWEST_S:g} s")
        time.sleep(0.002)
    with os.fdopen(pipe, encoding="utf-8", errors="replace") as stream:
        return Ended(os.waitstatus_to_exitcode(status), stream.read())


@dataclass(frozen=True)
class Size:
    """Of one command: file events of a run, bytes of its largest file and of all, and the names in its folder."""

    events: int
    largest: int
    total: int
    names: set[str]


def measured(commands: Commands, name: str, place: Path) -> Size:
    """A run without faults, in a child that counts."""
    out = place / ("organ.vtp" if name in FILES else "results")
    count = place.parent / f"events_{name}"
    child = os.fork()
    if not child:
        counted = counter(place)
        code = commands.call(name, out)
        count.write_text(str(counted()))
        os._exit(code)
    if os.waitpid(child, 0)[1]:
        raise RuntimeError(f"{name} fails without a fault")
    names = set() if name in FILES else names_below(out)
    sizes = [path.stat().st_size for path in ([out] if name in FILES else [out / file for file in names])]
    return Size(int(count.read_text()), max(sizes), sum(sizes), names)


def _signal_of(fault: Fault | None) -> int | None:
    return {"kill timed": signal.SIGKILL, "interrupt timed": signal.SIGINT}.get(fault.kind) if fault else None


def _seconds(process: int) -> float:
    """Processor time of a child so far."""
    fields = Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _two(commands: Commands, names: set[str], name: str, fault: Fault, out: Path) -> Verdict:
    """The first waits in the middle; the second is refused (a file: comes through); the first goes on to its end."""
    first = start(commands, name, out, fault)
    status = os.waitpid(first[0], os.WUNTRACED)[1]
    if not os.WIFSTOPPED(status):
        return Verdict("done", state(out, names))
    before = state(out, names)
    second = wait(start(commands, name, out, None), None)
    os.kill(first[0], signal.SIGCONT)
    ended, left = wait(first, None), state(out, names)
    debris = sorted(entry for entry in names_below(out.parent) if _is_hidden(entry))
    refused = second.code == 2 and BUSY in second.text
    free = second.code == 0 and (name in FILES or before in ("new", "absent", "older"))
    if ended.code == 0 and left == "new" and not debris and (refused or free):
        return Verdict("told" if refused else "done", left)
    return Verdict("told", left, f"{second.code} {second.text[-200:]}, {ended.code}, {left}, debris {debris}")


def _is_hidden(entry: str) -> bool:
    return any(part.startswith(".") for part in Path(entry).parts)


@contextmanager
def _disk(fault: Fault, folder: Path) -> Iterator[None]:
    """A small disk, or one that cannot be written, in place of ``folder``."""
    if fault.kind not in ("disk", "read-only"):
        yield
        return
    kept = folder.with_name("kept")
    shutil.copytree(folder, kept)
    size = int(fault.at) if fault.kind == "disk" else 1 << 20
    _mount("-t", "tmpfs", "-o", f"size={size}", "none", str(folder))
    try:
        shutil.copytree(kept, folder, dirs_exist_ok=True)
        if fault.kind == "read-only":
            _mount("-o", "remount,ro", str(folder))
        yield
    finally:
        subprocess.run(["umount", str(folder)], check=True)


def _mount(*words: str) -> None:
    subprocess.run(["mount", *words], check=True, capture_output=True)


def can_mount(folder: Path) -> bool:
    """Whether this user may make a small disk."""
    place = folder / "try"
    place.mkdir()
    try:
        _mount("-t", "tmpfs", "none", str(place))
    except (OSError, subprocess.CalledProcessError):
        return False
    else:
        subprocess.run(["umount", str(place)], check=True)
    finally:
        place.rmdir()
    return True
