"""Section 3, second part: figures and plots of the running simulation."""

from __future__ import annotations

import time
from typing import Any

from slicer.i18n import tr as _

from OrganPhysRegistrationLib.panel.section import Section

from .live_plot import LivePlot

EVERY_S = 0.1  # between two updates: readable, and cheap
PLOTTED = 150  # values per plot


class ReadingsSection(Section):
    """Force, volume, det F, times, contacts."""

    def __init__(self, panel: Any) -> None:
        super().__init__(panel)
        self._force = LivePlot(self.ui.forcePlot, _("Force (N)"), least=1.0)
        self._volume = LivePlot(self.ui.volumePlot, _("Volume (%)"), least=1.0, both_ways=True)
        self._last = 0.0

    def refresh(self) -> None:
        self._show()

    def frame(self) -> None:
        """A frame was shown."""
        if not self.panel.logic.running or time.monotonic() - self._last >= EVERY_S:
            self._last = time.monotonic()
            self._show()

    def _show(self) -> None:
        ui, logic = self.ui, self.panel.logic
        session = logic.session
        if session is None:
            for label in (ui.forceValue, ui.volumeValue, ui.stepValue, ui.detValue, ui.timeValue, ui.contactValue):
                label.text = "–"
            self._force.show([])
            self._volume.show([])
            return
        now, past = session.live.readings.last, list(session.live.readings.past)
        ui.forceValue.text = f"{now.force_n:.2f} N"
        ui.volumeValue.text = f"{now.volume_percent:+.2f} %"
        ui.stepValue.text = f"{now.step_ms:.1f} ms"
        ui.detValue.text = f"{now.min_det:.2f}"
        pace = f" ({logic.pace:.2f}x)" if logic.running else ""
        ui.timeValue.text = f"{session.live.time_s:.2f} s{pace}"
        touched = _("{count} held").format(count=now.held) if now.held else f"{now.contacts}"
        ui.contactValue.text = f"{touched}, {now.deepest_mm:.2f} mm"
        thin = max(1, len(past) // PLOTTED)
        self._force.show([reading.force_n for reading in past[::thin]])
        self._volume.show([reading.volume_percent for reading in past[::thin]])
