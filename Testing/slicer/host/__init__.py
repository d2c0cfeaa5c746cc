"""Runs a scripted 3D Slicer module without the Slicer application: see README.md beside this file."""

from __future__ import annotations

import os
import sys

from .record import record

_host = None


def start():
    """The one host of this process; the first call patches PySide6 and builds the scene."""
    global _host
    if _host is None:
        os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
        sys.excepthook = record.excepthook
        from . import ctk_module, qt_module
        from .lasting_none import keep_none

        keep_none()
        qt_module.install()
        ctk_module.install()
        from .session import Host

        _host = Host()
    return _host


def running():
    """The host if it has been started, else None."""
    return _host
