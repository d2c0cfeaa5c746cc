"""What each request of the session server does."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from ..exports.displacement_grid import sample_displacement
from ..ground.checks import Array, InputError
from ..ground.frames import Similarity
from ..ground.progress import Cancelled, Progress
from ..readers.organ_from_mask import organ_from_mask
from .case_file import load_case
from .case_outcome import CaseOutcome
from .follow_request import follow_case
from .live_request import changes_of, live_part
from .outcome_files import save_outcome
from .server_channel import Channel, Request
from .session import RegistrationSession
from .write_outputs import write_outputs

OUTCOMES_KEPT = 8  # a client that is slow to read still finds its own
SURFACES_KEPT = 20
PROGRESS_EVERY_S = 0.05


class Requests:
    """One session at a time, and the numbers of the files handed out."""

    def __init__(self, channel: Channel, folder: Path) -> None:
        self.channel, self.folder = channel, folder
        self._session: RegistrationSession | None = None
        self._last: CaseOutcome | None = None
        self._outcomes, self._surfaces, self._follows = 0, 0, 0
        self._do: dict[str, Callable[[Request, Progress], dict[str, Any]]] = {
            "load": self._load,
            "coarse": self._stage,
            "rigid": self._stage,
            "elastic": self._stage,
            "prepare": self._prepare,
            "update": self._update,
            "settle": self._settle,
            "follow": self._follow,
            "grids": self._grids,
            "report": self._report,
        }

    def run(self, request: Request) -> dict[str, Any]:
        """Fields of the "done" reply; InputError, Cancelled."""
        if request.problem:
            raise InputError(f"request: {request.problem}")
        do = request.fields.get("do")
        if not isinstance(do, str) or do not in self._do:
            raise InputError(f'request: "do" must be one of {", ".join(self._do)}, cancel, quit; got {do!r}'[:200])
        progress = self._progress(request)
        progress(do, 0.0)
        return self._do[do](request, progress)

    def _load(self, request: Request, progress: Progress) -> dict[str, Any]:
        self._session = load_case(self._inside(request.fields.get("case")), progress=progress)
        self._last = None
        return {}

    def _stage(self, request: Request, progress: Progress) -> dict[str, Any]:
        session, do = self._loaded(), request.fields["do"]
        start = request.fields.get("start")
        T_scene_ct = None if start is None else _pose(start)
        if do == "coarse":
            outcome = session.coarse(progress)
        elif do == "rigid":
            outcome = session.rigid(progress, start=T_scene_ct)
        else:
            outcome = session.elastic(progress, start=T_scene_ct, on_surface=self._surface_listener(request))
        return self._handed_out(outcome)

    def _prepare(self, request: Request, progress: Progress) -> dict[str, Any]:
        self._loaded().prepare_updates(progress)
        return {}

    def _update(self, request: Request, progress: Progress) -> dict[str, Any]:
        session = self._loaded()
        outcome = session.updated(progress, **changes_of(request.fields, session.state.case))
        return self._handed_out(live_part(outcome))

    def _settle(self, request: Request, progress: Progress) -> dict[str, Any]:
        return self._handed_out(self._loaded().settled(progress))

    def _follow(self, request: Request, progress: Progress) -> dict[str, Any]:
        self._follows += 1
        name = f"sequence_{self._follows}"
        follow_case(self._loaded(), request.fields, self.folder / name, progress)
        shutil.rmtree(self.folder / f"sequence_{self._follows - 1}", ignore_errors=True)
        return {"sequence": name}

    def _grids(self, request: Request, progress: Progress) -> dict[str, Any]:
        organ = self._loaded().registration.organ
        if self._last is None or self._last.stage != "elastic":
            raise InputError("grids: the elastic stage has not been run yet; run it first")
        return self._handed_out(replace(self._last, grids=sample_displacement(organ, progress=progress)))

    def _report(self, request: Request, progress: Progress) -> dict[str, Any]:
        folder = request.fields.get("folder")
        if not isinstance(folder, str) or not folder:
            raise InputError("report: name the folder that the files go into")
        self._loaded().settle(progress)
        registration = self._loaded().registration
        path = self.folder / folder  # an absolute path stays as it is
        try:
            path.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"{path}: cannot be made ({error.strerror or error}); choose another folder") from error
        write_outputs(registration, path)
        return {"folder": str(path)}

    def _loaded(self) -> RegistrationSession:
        if self._session is None:
            raise InputError('request: no case is loaded; send "load" first')
        return self._session

    def _inside(self, name: Any) -> Path:
        """A file in the shared folder."""
        if not isinstance(name, str) or not name or Path(name).name != name:
            raise InputError(f'load: "case" must name a file in the shared folder, got {name!r}'[:200])
        return self.folder / name

    def _handed_out(self, outcome: CaseOutcome) -> dict[str, Any]:
        self._outcomes += 1
        name = f"outcome_{self._outcomes}"
        save_outcome(outcome, self.folder / name)
        shutil.rmtree(self.folder / f"outcome_{self._outcomes - OUTCOMES_KEPT}", ignore_errors=True)
        self._last = outcome
        return {"outcome": name}

    def _surface_listener(self, request: Request) -> Callable[[Array], None]:
        def show(vertices: Array) -> None:
            self._surfaces += 1
            name = f"surface_{self._surfaces}.npy"
            temporary = self.folder / f".{name}"
            with temporary.open("wb") as file:
                np.save(file, vertices.astype(np.float32), allow_pickle=False)
            os.replace(temporary, self.folder / name)
            (self.folder / f"surface_{self._surfaces - SURFACES_KEPT}.npy").unlink(missing_ok=True)
            self.channel.tell(id=request.fields.get("id"), event="surface", file=name, stage="elastic")

        return show

    def _progress(self, request: Request) -> Progress:
        """Passes on what is new, at most twenty times a second, and ends a request that was cancelled."""
        told: dict[str, Any] = {"stage": None, "at": 0.0}

        def progress(stage: str, fraction: float) -> None:
            if self.channel.is_cancelled(request):
                raise Cancelled
            now = perf_counter()
            if stage != told["stage"] or fraction >= 1 or now - told["at"] > PROGRESS_EVERY_S:
                told.update(stage=stage, at=now)
                self.channel.tell(
                    id=request.fields.get("id"), event="progress", stage=stage, fraction=round(fraction, 4)
                )

        return progress


def warm_up() -> None:
    """Load what is otherwise loaded by the first run: VTK's filters are."""
    organ_from_mask(np.pad(np.ones((6, 6, 6), dtype=bool), 2), np.eye(4))


def _pose(start: Any) -> Similarity:
    try:
        matrix = np.array(start, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError("start: expected a 4 x 4 matrix of numbers, or null") from error
    return Similarity.of_matrix(matrix)
