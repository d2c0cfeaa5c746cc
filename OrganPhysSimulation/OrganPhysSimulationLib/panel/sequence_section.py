"""Section 6, the splat at every step: written beside the window, with progress, given up on request."""

from __future__ import annotations

from typing import Any

import qt
import slicer
from slicer.i18n import tr as _

from organphys.ground.progress import Cancelled
from OrganPhysRegistrationLib.panel.section import Section, guarded, tell_failure

PROGRESS_MS = 200  # between two looks at how far the writing is


class SequenceSection(Section):
    """The button becomes Cancel while files are written."""

    def __init__(self, panel: Any) -> None:
        super().__init__(panel)
        self.ui.exportSequenceButton.connect("clicked()", self.export)
        self._slot = self.refresh  # PythonQt keeps no reference to a bound method
        self._timer = qt.QTimer()
        self._timer.setInterval(PROGRESS_MS)
        self._timer.connect("timeout()", self._slot)

    def refresh(self) -> None:
        """Button and progress bar, as far as the writing is."""
        ui, logic = self.ui, self.panel.logic
        session, sequence = logic.session, logic.sequence
        ui.exportSequenceButton.text = _("Splat sequence...") if sequence is None else _("Cancel")
        if sequence is not None:
            percent = round(100 * sequence.fraction)
            ui.exportSequenceButton.enabled = not sequence.cancelled
            ui.progressBar.maximum, ui.progressBar.value = 100, percent
            ui.progressBar.format = _("Writing the splat – {percent} %").format(percent=percent)
            return
        ui.exportSequenceButton.enabled = session is not None and session.splat is not None and not logic.busy
        if self._timer.active:
            self._timer.stop()
            ui.progressBar.visible, ui.progressBar.maximum = False, 0

    def cleanup(self) -> None:
        self._timer.stop()
        super().cleanup()

    @guarded
    def export(self) -> None:
        """Ask for a folder and write the splat at every step into it, or give that up."""
        logic = self.panel.logic
        if logic.sequence is not None:
            logic.cancelSequence()
            self.panel.refresh()
            return
        title = _("Folder for the splat at every step since the last reset")
        folder = qt.QFileDialog.getExistingDirectory(slicer.util.mainWindow(), title)
        if folder:
            sequence = logic.writeSequence(folder, self._written, self._failed)
            text = _("Writing {count} frames of the splat; the simulation rests meanwhile.")
            self.panel.tell(text.format(count=sequence.frames))
            self._timer.start()
            self.panel.refresh()

    def _written(self, folder: str) -> None:
        self.panel.tell(_("Written: {path}").format(path=folder), "good")
        self.panel.refresh()

    def _failed(self, error: Exception) -> None:
        if isinstance(error, Cancelled):
            self.panel.tell(_("The export was given up; nothing was written."))
        else:
            tell_failure(self.panel, "export of the splat sequence", error)
        self.panel.refresh()
