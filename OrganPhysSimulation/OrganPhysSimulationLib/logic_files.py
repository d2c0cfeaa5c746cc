"""Recordings and files of a simulation. Part of the module's logic."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from organphys.ground.checks import InputError

from .outputs.export import export_recording, export_splat, export_surface
from .outputs.splat_sequence import SplatSequence, splat_sequence
from .session import SimulationSession


class SimulationFiles:
    """What the session that OrganPhysSimulationLogic holds records and writes."""

    _needed: Callable[[], SimulationSession]
    _in_background: Callable[..., None]
    pause: Callable[[], None]
    _sequence: SplatSequence | None = None

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
        """Write a file: "surface" (.stl, .ply, .vtp; RAS mm), "splat" (.ply) or "recording" (.npz); or "sequence",
        the splat at every step since the last reset, as a folder of .ply. Its path."""
        session = self._needed()
        if what == "surface":
            export_surface(session.surface.node, session.frame, path)
        elif what == "splat":
            export_splat(session.live, session.splat, path)
        elif what == "recording":
            export_recording(session.live, path)
        elif what == "sequence":
            splat_sequence(session.live, session.splat, path).write()
        else:
            raise InputError(f"export: expected surface, splat, sequence or recording, got {what!r}")
        return str(path)

    def writeSequence(
        self, folder: str | Path, onDone: Callable[[str], None], onFailed: Callable[[Exception], None]
    ) -> SplatSequence:
        """``export("sequence", folder)`` beside the window, while the stepping rests; its progress as ``fraction``.

        Then ``onDone(folder)`` or ``onFailed(exception)``: Cancelled after ``cancelSequence``. InputError as it begins:
        nothing can be written.
        """
        session = self._needed()
        sequence = splat_sequence(session.live, session.splat, folder)

        def ended(call: Callable[..., None], outcome: str | Exception) -> None:
            self._sequence = None
            call(outcome)

        self.pause()
        self._in_background(sequence.write, lambda path: ended(onDone, path), lambda error: ended(onFailed, error))
        self._sequence = sequence
        return sequence

    @property
    def sequence(self) -> SplatSequence | None:
        """What is being written beside the window."""
        return self._sequence

    def cancelSequence(self) -> None:
        """Give up what is being written: nothing of it stays."""
        if self._sequence is not None:
            self._sequence.cancelled = True
