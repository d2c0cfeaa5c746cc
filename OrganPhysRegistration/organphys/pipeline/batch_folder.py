"""The place of one case's results: a folder that is there as a whole or not at all, whatever dies when."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..ground.atomic_file import write_text
from ..ground.checks import InputError
from ..ground.plain_json import dump
from ..ground.strict_json import parse_json
from .provenance import fingerprint

RECORD, HIDDEN, ERRORS = "batch.json", ".batch", "errors"
SCHEMA = 1


@dataclass(frozen=True)
class CaseFolder:
    """``out``/``name``; what is not finished lies in ``out``/.batch. To be used under the case's lock only.

    The results are made in .batch/name.part and renamed to their place in one step. Older results of other inputs move
    to .batch/name.old before that, and back if the step never came.

    A case has its folder for itself, so all of it can be exchanged at once; ``output_folder.whole_or_nothing`` writes
    into folders that also hold files of others, and can only move its own one by one.
    """

    out: Path
    name: str

    @property
    def place(self) -> Path:
        return self.out / self.name

    @property
    def part(self) -> Path:
        return self.out / HIDDEN / f"{self.name}.part"

    @property
    def old(self) -> Path:
        return self.out / HIDDEN / f"{self.name}.old"

    @property
    def lock(self) -> Path:
        return self.out / HIDDEN / f"{self.name}.lock"

    @property
    def error_file(self) -> Path:
        return self.out / ERRORS / f"{self.name}.txt"

    def mend(self) -> None:
        """Undo what a run that died has left."""
        shutil.rmtree(self.part, ignore_errors=True)
        if self.old.exists() and not self.place.exists():
            os.rename(self.old, self.place)
        shutil.rmtree(self.old, ignore_errors=True)

    def finished(self, inputs: Mapping[str, Any]) -> dict[str, Any] | None:
        """The record of a whole folder made from ``inputs``; None where it is not that."""
        record = self.record()
        if record is None or record["inputs"] != json.loads(dump(inputs)):
            return None
        whole = all(fingerprint(str(self.place / file)) == entry for file, entry in record["files"].items())
        return record if whole else None

    def record(self) -> dict[str, Any] | None:
        """What the folder tells of itself; None where no batch has made it."""
        try:
            record = parse_json((self.place / RECORD).read_text(encoding="utf-8"))
        except (OSError, ValueError):  # not there, or no record: the case is to be done
            return None
        shaped = isinstance(record, dict) and record.get("schema") == SCHEMA and isinstance(record.get("files"), dict)
        return record if shaped and {"inputs", "result", "seconds"} <= record.keys() else None

    def begin(self) -> Path:
        """The empty folder to work in; InputError where the place holds files that are not a batch's."""
        if self.place.exists():
            record = self.record()
            known = {RECORD, *(record["files"] if record else ())}
            names = {path.name for path in self.place.iterdir()} if self.place.is_dir() else {self.name}
            others = sorted(name for name in names - known if name[0] != ".")  # a desktop's own, .DS_Store say, may go
            if others:
                raise InputError(
                    f"{self.place}: holds what no batch has written ({', '.join(others[:3])}); move it away or choose "
                    "another folder"
                )
        self.part.mkdir(parents=True)
        return self.part

    def publish(self, inputs: Mapping[str, Any], result: Mapping[str, Any], seconds: float) -> dict[str, Any]:
        """The folder of ``begin`` becomes the case's, with its record; the record."""
        files = {path.name: dict(fingerprint(str(path))) for path in sorted(self.part.iterdir()) if path.is_file()}
        record = {"schema": SCHEMA, "inputs": inputs, "seconds": seconds, "result": result, "files": files}
        write_text(self.part / RECORD, dump(record))
        if self.place.exists():
            os.rename(self.place, self.old)
        os.rename(self.part, self.place)
        shutil.rmtree(self.old, ignore_errors=True)
        self.error_file.unlink(missing_ok=True)
        return json.loads(dump(record))
