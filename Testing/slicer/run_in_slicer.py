"""Runs the module's self test in 3D Slicer and ends Slicer with its status, 0 when it passed:

Slicer --no-main-window --testing --python-script Testing/slicer/run_in_slicer.py
"""

from __future__ import annotations

import traceback
from pathlib import Path

import qt
import slicer

MODULE = "OrganPhysRegistration"


def load_module() -> None:
    """Load the module of this checkout, unless Slicer has loaded one at its start."""
    if hasattr(slicer.modules, MODULE.lower()):
        return
    path = Path(__file__).resolve().parents[2] / MODULE / f"{MODULE}.py"
    factory = slicer.app.moduleManager().factoryManager()
    factory.registerModule(qt.QFileInfo(str(path)))
    if not factory.isRegistered(MODULE) or not factory.loadModules([MODULE]):
        raise RuntimeError(f"Slicer could not load {path}")


def run_self_test() -> int:
    """Slicer's exit status: EXIT_SUCCESS, or EXIT_FAILURE after the traceback was printed."""
    try:
        load_module()
        slicer.selfTests[MODULE]()
    except Exception:
        traceback.print_exc()
        return slicer.util.EXIT_FAILURE
    return slicer.util.EXIT_SUCCESS


if __name__ == "__main__":
    slicer.util.exit(run_self_test())
