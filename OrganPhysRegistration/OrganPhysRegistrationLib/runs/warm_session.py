"""What the living child already knows: which case it has loaded and which stages it has done."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from .gathered_case import GatheredCase
from .run_process import RunProcess

STAGES = ("coarse", "rigid", "elastic")


class WarmSession:
    """Remembers the case of a RunProcess; a new child knows nothing."""

    def __init__(self, process: RunProcess) -> None:
        self.process = process
        self._known: tuple[int, str] = (0, "")
        self._done: set[str] = set()
        self.faces: Any = None  # (Nf, 3) of the loaded organ, None before its first stage is done

    @property
    def folder(self) -> Path:
        """Folder shared with the child; the child is started if it does not live."""
        return self.process.start()

    def plan(self, digest: str, stages: Sequence[str]) -> list[str]:
        """Requests that lead to ``stages``: "load" and earlier stages are left out where the child has them."""
        first, wanted = STAGES.index(stages[0]), list(stages)
        if not self._knows(digest):
            return ["load", *STAGES[:first], *wanted]
        return [*(stage for stage in STAGES[:first] if stage not in self._done), *wanted]

    def loaded(self, digest: str) -> None:
        """The child has loaded the case."""
        self._known, self._done = (self.process.generation, digest), set()

    def finished(self, stage: str) -> None:
        """The child has done the stage; those after it are out of date."""
        self._done -= set(STAGES[STAGES.index(stage) :])
        self._done.add(stage)

    @property
    def registered(self) -> bool:
        """Whether the child has done the elastic stage of the case it was given last."""
        return self.process.running and self._known[0] == self.process.generation and "elastic" in self._done

    def detached(self) -> None:
        """The child's case has been changed since it was loaded: a run loads its own."""
        self._known, self._done = (0, ""), set()

    def forget(self) -> None:
        """The child's state is not known any more."""
        self._known, self._done, self.faces = (0, ""), set(), None

    def _knows(self, digest: str) -> bool:
        return self.process.running and self._known == (self.process.generation, digest)


def case_digest(case: GatheredCase) -> str:
    """Fingerprint of everything a registration depends on."""
    digest = hashlib.blake2b(digest_size=16)
    arrays = (case.segment.mask, case.segment.ijk_to_ras, case.splat.centres, case.splat.opacities, case.splat.valid)
    for array in (*arrays, case.splat.colours):
        digest.update(str(array.shape).encode())
        digest.update(np.ascontiguousarray(array))
    digest.update(json.dumps(_settings(case), sort_keys=True, default=_plain).encode())
    return digest.hexdigest()


def _settings(case: GatheredCase) -> dict[str, Any]:
    records = {name: getattr(case, name) for name in ("landmarks", "camera", "box", "unit")}
    return {
        **{name: None if record is None else asdict(record) for name, record in records.items()},
        "settings": case.settings,
        "opening": case.opening,
        "close_holes": case.close_holes,
        "name": case.segment.name,
    }


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray) else str(value)
