"""How a figure was measured: command, date, commit, machine, versions, and how busy the machine was."""

from __future__ import annotations

import datetime
import os
import platform
from importlib.metadata import version

from results_table import _commit, _processor


def how(command: str) -> str:
    """Lines for RESULTS.md."""
    packages = ", ".join(f"{name} {version(name)}" for name in ("organphys", "numpy", "scipy"))
    load = f"{os.getloadavg()[1]:.1f}" if hasattr(os, "getloadavg") else "not known"
    return (
        f"- command: `{command}`\n"
        f"- date: {datetime.date.today().isoformat()}, commit {_commit()}\n"
        f"- machine: {_processor()}, {os.cpu_count()} cores, {platform.system()}, "
        f"OMP_NUM_THREADS={os.environ.get('OMP_NUM_THREADS', 'not set')}, load over 5 minutes {load}\n"
        f"- versions: Python {platform.python_version()}, {packages}"
    )
