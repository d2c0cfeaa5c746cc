"""Undoing a run: everything it wrote goes back to what was there before."""

from __future__ import annotations

from typing import Any

from organphys.ground.checks import InputError

from .case_nodes import batch, case_of, new_case_id
from .case_record import CaseNodes
from .snapshot import SceneSnapshot


class RunUndo:
    """What the scene held of a case and its splat before a run. Make it before the run's first ``write_outcome``."""

    def __init__(self, case: CaseNodes, splat: Any) -> None:
        self._case, self._splat = case, splat
        self._snapshot: SceneSnapshot | None = SceneSnapshot(case, splat)

    @property
    def case_id(self) -> str:
        """Case that the run writes into."""
        return self._case.case_id

    @property
    def possible(self) -> bool:
        """Whether it was not undone yet and the splat is still in the scene."""
        return self._snapshot is not None and bool(self._case.scene.IsNodePresent(self._splat))

    def undo(self) -> None:
        """Put back the previous result, or remove the case if the run made it. InputError if that is not possible."""
        if self._snapshot is None:
            raise InputError("undo: this run was undone already")
        if not self.possible:
            raise InputError("undo: the splat of this run is no longer in the scene")
        with batch(self._case.scene):
            self._snapshot.restore()
        self._snapshot = None


def begin_run(segmentation: Any, segment_id: str, splat: Any) -> RunUndo:
    """Remember the scene before a run; its results go to ``write_outcome(..., case_id=undo.case_id)``."""
    case = case_of(segmentation, segment_id, splat)
    return RunUndo(case or CaseNodes(new_case_id(), splat.GetScene()), splat)
