"""How a figure was measured: command, date, commit, machine, versions, and how busy the machine was."""

from __future__ import annotations

import datetime
import os
import platform
from importlib.metadata import version

from results_table import _commit, _processor


def how(command: str) -> str:
    """Lines for RESULTS.md."""
    return (
        f"- command: `{command}`\n"
        f"- date: {datetime.date.today().isoformat()}, commit {_commit()}\n"
        f"- machine: {machine()}, {platform.system()}, {_threads_and_load()}\n"
        f"- versions: Python {platform.python_version()}, {_versions('organphys', 'numpy', 'scipy')}"
    )


def when() -> str:
    """The same in one line, for a single measurement: all but command and machine."""
    versions = f"Python {platform.python_version()}, {_versions('numpy', 'scipy')}"
    return f"{datetime.date.today().isoformat()}, commit {_commit()}, {_threads_and_load()}, {versions}"


def machine() -> str:
    return f"{_processor()}, {os.cpu_count()} cores"


def _threads_and_load() -> str:
    load = f"{os.getloadavg()[1]:.1f}" if hasattr(os, "getloadavg") else "not known"
    return f"OMP_NUM_THREADS={os.environ.get('OMP_NUM_THREADS', 'not set')}, load over 5 minutes {load}"


def _versions(*names: str) -> str:
    return ", ".join(f"{name} {version(name)}" for name in names)
