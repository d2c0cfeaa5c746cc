"""``python -m host.probe``: can this machine run the host? Starts it and draws a view; a crash stays in here."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

PACKAGES = "pip install -c constraints.txt -e '.[slicer-test]' (Linux x86-64, Python 3.10 to 3.13)"
LIBRARIES = (
    "libegl1 libegl-mesa0 libgl1 libgl1-mesa-dri libxkbcommon0 libfontconfig1 libglib2.0-0 libdbus-1-3 "
    "fonts-dejavu-core"
)
DONE = "the host draws"


def reason_not_to_run(timeout: float = 180) -> str:
    """Why the host cannot run here, in one line that says what to do; empty if it can."""
    command = [sys.executable, "-m", "host.probe"]
    folder = Path(__file__).resolve().parents[1]
    try:
        result = subprocess.run(
            command, cwd=folder, capture_output=True, text=True, errors="replace", timeout=timeout, check=False
        )
    except subprocess.TimeoutExpired:
        return f"the test host did not start within {timeout:g} s"
    if DONE in result.stdout:
        return ""
    complaints = (result.stderr or result.stdout).strip().splitlines() or ["no message"]
    last = complaints[-1].strip()[:200]
    if "No module named" in last:
        return f"{last}: {PACKAGES}"
    return f"the test host ended with status {result.returncode} ({last}); needs: apt-get install {LIBRARIES}"


def main() -> None:
    import PySide6  # noqa: F401
    import slicer_core  # noqa: F401

    from . import start

    host = start()
    import slicer

    view = slicer.app.layoutManager().threeDWidget(0).threeDView()
    view.forceRender()
    if not view.renderWindow().SupportsOpenGL():
        raise RuntimeError("no OpenGL")
    host.remove_files()
    print(DONE, flush=True)
    os._exit(0)  # the interpreter's teardown of Qt and VTK may crash; nothing is left to do


if __name__ == "__main__":
    main()
