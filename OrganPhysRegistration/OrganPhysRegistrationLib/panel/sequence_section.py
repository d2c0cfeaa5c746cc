"""Section 5: follow the organ through a folder of splats and play it."""

from __future__ import annotations

from typing import Any

import qt
from slicer.i18n import tr as _

from .section import Section, guarded


class SequenceSection(Section):
    """Choose the folder, press Follow; it becomes Cancel while it runs. Play steps through the frames."""

    def __init__(self, panel: Any) -> None:
        super().__init__(panel)
        self.run: Any = None
        ui = self.ui
        ui.sequenceFolderButton.connect("clicked()", self.choose)
        ui.followButton.connect("clicked()", self.follow)
        ui.playButton.connect("clicked()", self.play)
        ui.sequenceFolderEdit.connect("textChanged(QString)", self.panel.refresh_soon)

    @property
    def running(self) -> bool:
        """Whether a sequence is being followed."""
        return self.run is not None and not self.run.finished

    def refresh(self) -> None:
        ui, reasons = self.ui, [] if self.running else self.panel.logic.problems(self.panel.parameters)
        ui.followButton.text = _("Cancel") if self.running else _("Follow")
        ui.followButton.enabled = self.running or (not reasons and bool(ui.sequenceFolderEdit.text.strip()))
        ui.followButton.toolTip = "\n".join(reasons) or _(
            "Register the first splat and follow the organ in the others."
        )
        ui.playButton.enabled = self.nodes() is not None

    def nodes(self) -> Any:
        """Sequence nodes of the last run that are still in the scene."""
        nodes = None if self.run is None else self.run.nodes
        return nodes if nodes is not None and nodes.browser.GetScene() is not None else None

    @guarded
    def choose(self) -> None:
        """Ask for the folder."""
        folder = qt.QFileDialog.getExistingDirectory(None, _("Folder with one splat per time step"))
        if folder:
            self.ui.sequenceFolderEdit.text = folder

    @guarded
    def follow(self) -> None:
        """Start, or cancel what runs."""
        if self.running:
            self.run.cancel()
            return
        self.run = self.panel.logic.followSequence(
            self.panel.parameters,
            self.ui.sequenceFolderEdit.text.strip(),
            fps=self.ui.fpsSpinBox.value or None,
            onProgress=lambda done: self._say(_("Following: {percent} %").format(percent=round(100 * done))),
            onDone=self._done,
            onFailed=lambda code, message: self._say(message),
        )
        self._say(_("Reading the inputs"))

    @guarded
    def play(self) -> None:
        """Play, or stop playing."""
        browser = self.nodes().browser
        browser.SetPlaybackActive(not browser.GetPlaybackActive())
        self.ui.playButton.text = _("Stop") if browser.GetPlaybackActive() else _("Play")

    def _done(self, nodes: Any) -> None:
        text = _("{count} frames followed.").format(count=len(nodes.facts["times"]))
        told = [_("Frame {k}: {what}.").format(k=k, what=what) for k, what in nodes.facts["notices"]]
        self._say(" ".join([text, *told]))

    def _say(self, text: str) -> None:
        self.ui.sequenceLabel.text = text
        self.panel.refresh_soon()
