"""One input given to one reader: what came of it, and what it took."""

from __future__ import annotations

import ctypes
import os
import re
import traceback
import zlib
from dataclasses import dataclass
from pathlib import Path

from targets import MEGABYTE, Target

from organphys.ground.checks import InputError

BASE_BYTES = 4 * MEGABYTE  # what a library may take at a call that no seed made, whatever the file
LONGEST_MESSAGE = 1000
LINUX = Path("/proc/self/clear_refs").exists()
STATUS = os.open("/proc/self/status", os.O_RDONLY) if LINUX else None
CLEAR = os.open("/proc/self/clear_refs", os.O_WRONLY) if LINUX else None
GIVE_BACK = getattr(ctypes.CDLL(None), "malloc_trim", None) if LINUX else None


@dataclass(frozen=True)
class Outcome:
    """kind: "read", "refused" or "failed"; what: signature of a failure, the same for the same weakness."""

    kind: str
    what: str = ""
    detail: str = ""


def tried(target: Target, path: Path, content: bytes) -> Outcome:
    """The outcome of reading ``path``, which holds ``content``."""
    if GIVE_BACK is not None:
        GIVE_BACK(0)  # so that memory which earlier inputs have freed counts again when this one takes it
    start = _memory(b"VmRSS")
    _forget_peak()
    try:
        result = target.read(path)
        peak = _memory(b"VmHWM") - start
        outcome = _judged(target, path.name, content, result)
        del result
    except InputError as error:
        peak = _memory(b"VmHWM") - start
        outcome = _message(str(error), str(path))
    except Exception as error:
        peak = 0
        outcome = Outcome("failed", f"{type(error).__name__} at {_place(error)}", traceback.format_exc()[-3000:])
    if peak > BASE_BYTES and peak > BASE_BYTES + 2 * target.honest * unpacked_size(content):
        return Outcome("failed", "memory", f"{peak / MEGABYTE:.0f} MB for {unpacked_size(content)} bytes unpacked")
    return outcome


def _judged(target: Target, name: str, content: bytes, result: object) -> Outcome:
    try:
        problem = target.problem(name, content, result)
    except Exception as error:  # the second reading cannot follow what the reader took
        problem = f"{type(error).__name__} in the check at {_place(error)}: {str(error)[:200]}"
    return Outcome("read") if problem is None else Outcome("failed", f"wrong success: {_plain(problem)}", problem)


def _message(text: str, path: str) -> Outcome:
    if not text or not text.isprintable() or len(text.replace(path, "")) > LONGEST_MESSAGE:
        return Outcome("failed", f"message: {_plain(text.replace(path, ''))[:60]}", repr(text)[:2000])
    return Outcome("refused")


def _place(error: BaseException) -> str:
    """File and line, of the last frame and of the last one of organphys."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [f for f in frames if "organphys" in f.filename]
    return " < ".join(dict.fromkeys(f"{Path(f.filename).name}:{f.lineno}" for f in (frames[-1], *own[-1:])))


def _plain(text: str) -> str:
    return re.sub(r"[-+]?\d[\d.e+-]*|'.*?'|\{.*", "#", text.splitlines()[0] if text else "empty")[:80]


def _memory(name: bytes) -> int:
    """Resident bytes now (VmRSS) or at most since ``_forget_peak`` (VmHWM); 0 where the system does not tell."""
    if STATUS is None:
        return 0
    text = os.pread(STATUS, 4096, 0)
    at = text.index(name) + len(name) + 1
    return 1024 * int(text[at : text.index(b"kB", at)])


def _forget_peak() -> None:
    if CLEAR is not None:
        os.pwrite(CLEAR, b"5", 0)


def unpacked_size(content: bytes) -> int:
    """Bytes of a file, its first packed stream unpacked, all of it."""
    starts = [content.find(sign) for sign in (b"\x1f\x8b", b"\x78\x9c", b"\x78\xda", b"\x78\x5e", b"\x78\x01")]
    at = min((start for start in starts if start >= 0), default=-1)
    if at < 0:
        return len(content)
    stream, total = zlib.decompressobj(47), 0
    try:
        for start in range(at, len(content), 4096):
            total += len(stream.decompress(content[start : start + 4096]))
    except zlib.error:
        pass
    return len(content) + total
