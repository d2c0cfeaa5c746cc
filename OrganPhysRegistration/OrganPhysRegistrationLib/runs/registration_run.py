"""One registration from Apply to the last node, as a state machine on the event loop.

preparing (nodes -> files) -> running (the child's stages) -> writing (files -> nodes) -> sampling (transform grids)
-> finished. Cancelling, a failure, a removed node and a closed scene lead to finished from everywhere, by way of
cancelling where the child has to stop first, and leave the scene as it was before the run.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from organphys.ground.checks import Array, InputError
from organphys.points.point_sets import Landmarks

from ..outputs.case_record import CaseNodes
from ..outputs.undo import RunUndo
from .case_files import SavedCase, outcome_steps, save_case_steps
from .input_problems import sentence
from .live_view import LiveView
from .result_nodes import WrittenCase, result_steps, transform_steps
from .run_callbacks import RunCallbacks, nothing
from .run_inputs import RunInputs
from .run_process import Event
from .scene_watch import SceneWatch
from .stage_requests import RESULTS, StageRequests
from .stepped_work import SteppedWork, run_at_once
from .warm_session import WarmSession


class RegistrationRun:
    """A run; it starts at once. ``state``: see the module; ``case``, ``undo``: its nodes once they are written, and the
    way back from them.

    ``stages``: neighbours of ("coarse", "rigid", "elastic"); earlier ones are done too where the child has not done
    them for these inputs. ``start`` (4, 4): T_scene_ct set by hand that the first of ``stages`` begins with.
    ``on_end``: called with the run once it is finished, before anybody else is told.
    """

    def __init__(
        self,
        session: WarmSession,
        inputs: RunInputs,
        stages: Sequence[str],
        callbacks: RunCallbacks,
        *,
        start: Any = None,
        on_end: Callable[[RegistrationRun], None] = nothing,
    ) -> None:
        self.inputs, self.state = inputs, "preparing"
        self.case: CaseNodes | None = None
        self.undo: RunUndo | None = None
        self.landmarks: Landmarks | None = None  # as registered, once the nodes are read
        self._session, self._stages, self._tell, self._on_end = session, tuple(stages), callbacks, on_end
        self._start = None if start is None else [[float(x) for x in row] for row in start]
        self._requests = StageRequests(
            session,
            on_progress=callbacks.progress,
            on_surface=self._show_points,
            on_stage=self._show_stage,
            on_done=self._stages_done,
            on_failed=self._child_failed,
        )
        self._live = LiveView(inputs)
        self._watch = SceneWatch(
            inputs.nodes,
            segmentation=inputs.segmentation,
            segment_id=inputs.segment_id,
            on_removed=self._node_removed,
            on_closing=self._scene_closing,
        )
        self._begin(save_case_steps(inputs, session.process.start()), self._prepared)

    @property
    def finished(self) -> bool:
        """Whether everything is done or given up, the child's request included."""
        return self.state == "finished"

    def cancel(self) -> None:
        """Give the run up: the scene is restored now; ``failed`` follows when the child has stopped, within 1.5 s."""
        self._give_up("cancelled", "The registration was cancelled.")

    def _begin(self, steps: Any, on_done: Callable[[Any], None]) -> None:
        self._work = SteppedWork(steps, on_done=on_done, on_error=self._step_failed)

    def _prepared(self, saved: SavedCase) -> None:
        self.state, self.landmarks = "running", saved.landmarks
        self._requests.begin(saved, self._stages, self._start)
        self._live.start(self._session.faces)  # those of another organ are forgotten by now

    def _show_points(self, points: Array) -> None:
        self._live.show(points)
        self._tell.surface(points)

    def _show_stage(self, folder: Path) -> None:
        outcome = run_at_once(outcome_steps(folder))
        self._session.faces = outcome.faces
        self._live.start(outcome.faces)
        self._show_points(outcome.surfaces[outcome.stage])

    def _stages_done(self, folder: Path) -> None:
        self.state = "writing"
        self._requests.report(RESULTS, RESULTS, 0.0)
        self._begin(result_steps(folder, self.inputs), self._written)

    def _written(self, written: WrittenCase) -> None:
        self.case, self.undo = written.case, written.undo
        self._live.remove()
        if self._stages[-1] == "elastic":
            self.state = "sampling"
            self._session.process.request("grids", self._on_grids)
        else:
            self._end()
        self._requests.report(RESULTS, RESULTS, 1.0)
        self._tell.done(self.case)

    def _on_grids(self, event: Event) -> None:
        if self.state != "sampling":
            return
        if event["event"] == "done":
            self._begin(transform_steps(self._session.folder / event["outcome"], self.case), self._transforms_written)
        elif event["event"] == "failed":
            self._transform_failed(str(event.get("message", "")))

    def _transforms_written(self, _nothing: None) -> None:
        self._end()
        self._tell.transform(self.case)

    def _transform_failed(self, message: str) -> None:
        self._end()
        self._tell.failed("transform", f"The transform is missing: {sentence(message)} Press Register to make it.")

    def _node_removed(self, name: str) -> None:
        if self.state != "sampling":  # then the result stands already
            text = f"The {name} was removed from the scene, so the registration was stopped: choose another one."
            self._give_up("input", text)

    def _scene_closing(self) -> None:
        self._give_up("closed", "The scene was closed, so the registration was stopped.")

    def _step_failed(self, error: Exception) -> None:
        if not isinstance(error, InputError):
            logging.error("OrganPhys: the registration failed", exc_info=error)
        if self.state == "sampling":
            self._transform_failed(str(error) or type(error).__name__)
        elif isinstance(error, InputError):
            self._give_up("input", sentence(str(error)))
        else:
            self._give_up(
                "internal", f"The registration failed ({error}): see Slicer's log, then press Register again."
            )

    def _child_failed(self, code: str, message: str) -> None:
        self._give_up(code, sentence(message))

    def _give_up(self, code: str, message: str) -> None:
        """Restore the scene; finish when the child has dropped its request."""
        if self.state in ("cancelling", "finished"):
            return
        self.state = "cancelling"
        self._work.stop()
        self._requests.give_up()
        self._watch.remove()
        self._live.remove()
        undo, self.case, self.undo = self.undo, None, None
        if undo is not None and code != "closed" and undo.possible:
            undo.undo()
        self._session.process.cancel(lambda: self._stopped(code, message))

    def _stopped(self, code: str, message: str) -> None:
        self._end()
        self._tell.failed(code, message)

    def _end(self) -> None:
        self._watch.remove()
        self.state = "finished"
        self._on_end(self)
