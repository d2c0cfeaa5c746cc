"""Work on the main thread in short steps, so that Slicer's window answers in between."""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import Any

import qt


class SteppedWork:
    """Runs a generator: every ``yield`` gives the event loop a turn.

    ``on_done``: called with what the generator returns; ``on_error``: with the exception it raises. After ``stop``
    neither is called and the generator's ``finally`` blocks have run.
    """

    def __init__(
        self,
        steps: Generator[None, None, Any],
        *,
        on_done: Callable[[Any], None],
        on_error: Callable[[Exception], None],
    ) -> None:
        self._steps, self._on_done, self._on_error = steps, on_done, on_error
        self._slot = self._step  # PythonQt keeps no reference to a bound method
        self._timer = qt.QTimer()
        self._timer.setInterval(0)
        self._timer.connect("timeout()", self._slot)
        self._timer.start()

    def stop(self) -> None:
        """Give the work up."""
        self._end()
        self._steps.close()

    def _step(self) -> None:
        try:
            next(self._steps)
        except StopIteration as end:
            self._end()
            self._on_done(end.value)
        except Exception as error:
            self._end()
            self._on_error(error)

    def _end(self) -> None:
        """No more steps. The connection goes too: it would hold this object, and whose work it is, for good."""
        self._timer.stop()
        self._timer.disconnect("timeout()", self._slot)


def run_at_once(steps: Generator[None, None, Any]) -> Any:
    """What the generator returns, without pauses."""
    result = []

    def relay() -> Generator[None, None, None]:
        result.append((yield from steps))

    for _ in relay():
        pass
    return result[0]
