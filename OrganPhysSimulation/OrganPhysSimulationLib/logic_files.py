"""Recordings and files of a simulation. Part of the module's logic."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from organphys.ground.checks import InputError

from .outputs.export import export_recording, export_splat, export_surface
from .session import SimulationSession


class SimulationFiles:
    """What the session that OrganPhysSimulationLogic holds records and writes."""

    _needed: Callable[[], SimulationSession]

    def startRecording(self) -> None:
        """Record every shown frame into sequence nodes."""
        session = self._needed()
        if session.recorder is None:
            session.start_recording()

    def stopRecording(self) -> Any:
        """The sequence browser of the recording, None if nothing was recorded."""
        session = self._needed()
        recorder, session.recorder = session.recorder, None
        return None if recorder is None else recorder.finish()

    def export(self, what: str, path: str | Path) -> str:
        """Write a file: "surface" (.stl, .ply, .vtp; RAS mm), "splat" (.ply) or "recording" (.npz); its path."""
        session = self._needed()
        if what == "surface":
            export_surface(session.surface.node, session.frame, path)
        elif what == "splat":
            export_splat(session.live, session.splat, path)
        elif what == "recording":
            export_recording(session.live, path)
        else:
            raise InputError(f"export: expected surface, splat or recording, got {what!r}")
        return str(path)
