"""How the registration server is started: which Python, with which arguments and environment."""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path

import qt

MODULE_FOLDER = Path(__file__).resolve().parents[2]  # holds organphys, also once installed
SERVER = "organphys.pipeline.session_server"

# -m would search a copy of organphys in Slicer's site-packages first: PythonSlicer puts those ahead of PYTHONPATH.
START = "import runpy, sys; sys.path.insert(0, sys.argv.pop(1)); runpy.run_module({server!r}, None, '__main__', True)"


def python_program() -> str:
    """PythonSlicer inside Slicer, else the Python that runs."""
    return shutil.which("PythonSlicer") or sys.executable


def server_arguments(folder: str | Path) -> list[str]:
    """Arguments of the Python that runs the server on ``folder``."""
    return ["-c", START.format(server=SERVER), str(MODULE_FOLDER), "--folder", str(folder)]


def server_environment() -> qt.QProcessEnvironment:
    """This application's environment, with the module's own organphys on the path and output that is not held back."""
    environment = qt.QProcessEnvironment.systemEnvironment()
    inherited = environment.value("PYTHONPATH", "")
    environment.insert("PYTHONPATH", os.pathsep.join(filter(None, (str(MODULE_FOLDER), inherited))))
    environment.insert("PYTHONUNBUFFERED", "1")
    environment.insert("PYTHONIOENCODING", "utf-8")
    return environment
