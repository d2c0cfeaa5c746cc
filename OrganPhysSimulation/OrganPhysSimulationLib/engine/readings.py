"""What the panel reads off a running simulation, with its recent past for the plots."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

import numpy as np

from organphys.ground.checks import Array
from organphys.simulation.step import StepReport
from organphys.simulation.tool_force import low_pass

PAST = 300  # readings kept for the plots: five seconds at 60 Hz


@dataclass(frozen=True)
class Reading:
    """time_s: simulated; force_n: low-passed size of the force on the tool; volume_percent: change of the volume since
    the registered shape; min_det: lowest det F; step_ms: computing time; deepest_mm: largest penetration."""

    time_s: float = 0.0
    force_n: float = 0.0
    volume_percent: float = 0.0
    min_det: float = 1.0
    step_ms: float = 0.0
    deepest_mm: float = 0.0
    contacts: int = 0
    held: int = 0


@dataclass
class Readings:
    """The last reading and the past, oldest first."""

    last: Reading = field(default_factory=Reading)
    past: deque[Reading] = field(default_factory=lambda: deque(maxlen=PAST))
    _force: Array = field(default_factory=lambda: np.zeros(3))

    def add(self, report: StepReport, *, time_s: float, dt: float, step_ms: float, held: int) -> Reading:
        """One more reading, of a step of ``dt`` s."""
        body = report.bodies[0]
        self._force = low_pass(self._force, report.forces[0].force, dt)
        self.last = Reading(
            time_s=time_s,
            force_n=float(np.linalg.norm(self._force)),
            volume_percent=100 * body.volume_change,
            min_det=body.min_det,
            step_ms=step_ms,
            deepest_mm=1e3 * body.deepest_m,
            contacts=body.contacts,
            held=held,
        )
        self.past.append(self.last)
        return self.last

    def clear(self) -> None:
        """As before the first step."""
        self.past.clear()
        self.last, self._force = Reading(), np.zeros(3)
