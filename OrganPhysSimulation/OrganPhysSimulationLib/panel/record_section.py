"""Section 6: recording, playing back, files."""

from __future__ import annotations

from typing import Any

import qt
import slicer
from slicer.i18n import tr as _

from OrganPhysRegistrationLib.panel.section import Section, guarded

from ..outputs.recorder import frame_count, recordings, show_frame

PLAY_MS = 33  # between two played frames


class RecordSection(Section):
    """Records into sequence nodes; plays the newest recording."""

    def __init__(self, panel: Any) -> None:
        super().__init__(panel)
        ui = self.ui
        ui.recordButton.connect("toggled(bool)", self.record)
        ui.playButton.connect("toggled(bool)", self.play)
        ui.frameSlider.connect("valueChanged(double)", self.show_frame)
        ui.exportSurfaceButton.connect("clicked()", lambda: self.export("surface", "*.stl *.ply *.vtp"))
        ui.exportSplatButton.connect("clicked()", lambda: self.export("splat", "*.ply"))
        ui.exportRecordingButton.connect("clicked()", lambda: self.export("recording", "*.npz"))
        self._showing = False
        self._slot = self._next
        self._timer = qt.QTimer()
        self._timer.setInterval(PLAY_MS)
        self._timer.connect("timeout()", self._slot)

    def bind(self) -> None:
        self._timer.stop()

    def refresh(self) -> None:
        ui, logic = self.ui, self.panel.logic
        session, browser = logic.session, self._browser()
        recording = session is not None and session.recorder is not None
        frames = 0 if browser is None else frame_count(browser)
        self._showing = True
        try:
            ui.recordButton.checked = recording
            ui.frameSlider.maximum = max(1, frames - 1)
        finally:
            self._showing = False
        ui.recordButton.text = _("End recording") if recording else _("Record")
        ui.recordButton.enabled = session is not None and not logic.busy
        can_play = frames > 0 and session is not None and not logic.running and not recording
        ui.playButton.enabled = ui.frameSlider.enabled = can_play
        if not can_play and ui.playButton.checked:
            ui.playButton.checked = False
        for button in (ui.exportSurfaceButton, ui.exportRecordingButton):
            button.enabled = session is not None and not logic.busy
        ui.exportSplatButton.enabled = session is not None and session.splat is not None and not logic.busy

    def cleanup(self) -> None:
        self._timer.stop()
        super().cleanup()

    @guarded
    def record(self, on: bool) -> None:
        """Begin a recording, or end it."""
        if self._showing:
            return
        logic = self.panel.logic
        if on:
            logic.startRecording()
        else:
            browser = logic.stopRecording()
            if browser is not None:
                text = _("Recorded {count} frames: play them here or in the Sequences module.")
                self.panel.tell(text.format(count=frame_count(browser)), "good")
        self.panel.refresh()

    @guarded
    def play(self, on: bool) -> None:
        """Play the newest recording from its first frame, or stop."""
        if on:
            self.ui.frameSlider.value = 0
            self._timer.start()
        else:
            self._timer.stop()
        self.ui.playButton.text = _("Stop") if on else _("Play")

    @guarded
    def show_frame(self, index: float) -> None:
        """Show one recorded frame."""
        session, browser = self.panel.logic.session, self._browser()
        if not self._showing and session is not None and browser is not None and not self.panel.logic.running:
            show_frame(browser, round(index))
            session.show_recorded()

    @guarded
    def export(self, what: str, kinds: str) -> None:
        """Ask where to and write a file."""
        path = qt.QFileDialog.getSaveFileName(slicer.util.mainWindow(), _("Export"), "", f"{what} ({kinds})")
        if path:
            with slicer.util.WaitCursor():
                written = self.panel.logic.export(what, path)
            self.panel.tell(_("Written: {path}").format(path=written), "good")

    def _next(self) -> None:
        slider = self.ui.frameSlider
        if slider.value >= slider.maximum:
            self.ui.playButton.checked = False
        else:
            slider.value = slider.value + 1

    def _browser(self) -> Any:
        found = recordings()
        return found[-1] if found else None
