"""Slicer's event loop, GIL included.

Slicer runs Qt's loop from C++ and keeps the GIL while it waits for events; PySide6 gives the GIL back, so a Python
thread that starves in Slicer would run here. Calling Qt through ctypes.PyDLL keeps the GIL, as in Slicer: only what
Python code on the main thread gives (time.sleep, file reading, 5 ms turns) is left for other Python threads.
"""

from __future__ import annotations

import ctypes
import time
from collections.abc import Callable
from pathlib import Path

import PySide6
import shiboken6
from PySide6 import QtCore


def _qt_core() -> ctypes.PyDLL:
    library = ctypes.PyDLL(str(Path(PySide6.__file__).parent / "Qt" / "lib" / "libQt6Core.so.6"))
    library.process_events = library["_ZN16QCoreApplication13processEventsE6QFlagsIN10QEventLoop17ProcessEventsFlagEE"]
    library.process_events.argtypes, library.process_events.restype = [ctypes.c_int], None
    library.run_loop = library["_ZN10QEventLoop4execE6QFlagsINS_17ProcessEventsFlagEE"]
    library.run_loop.argtypes, library.run_loop.restype = [ctypes.c_void_p, ctypes.c_int], ctypes.c_int
    return library


_QT = _qt_core()


def process_events(*_flags: object) -> None:
    """One turn of the event loop with the GIL held; deferred deletions included."""
    _QT.process_events(0)
    QtCore.QCoreApplication.sendPostedEvents(None, QtCore.QEvent.Type.DeferredDelete.value)


def run_loop(loop: QtCore.QEventLoop, *_flags: object) -> int:
    """``QEventLoop.exec`` with the GIL held."""
    return _QT.run_loop(shiboken6.getCppPointer(loop)[0], 0)


def wait(seconds: float) -> None:
    """Run the event loop for so long, as Slicer would with nothing else to do."""
    loop, timer = QtCore.QEventLoop(), QtCore.QTimer()
    timer.setSingleShot(True)
    timer.timeout.connect(loop.quit)  # C++ to C++: no Python code, so no turn for other threads
    timer.start(max(0, round(1000 * seconds)))
    run_loop(loop)


def wait_until(condition: Callable[[], object], timeout: float = 60.0, poll: float = 0.05) -> None:
    """Run the event loop until ``condition()`` is true; TimeoutError after ``timeout`` seconds.

    Looking at the condition lends other Python threads 5 ms every ``poll`` seconds; ``wait`` lends them nothing.
    """
    end = time.monotonic() + timeout
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError(f"the awaited condition did not come true within {timeout:g} s")
        wait(poll)
