"""One JSON file per finished run: where it lies, and how it is written whole."""

from __future__ import annotations

import datetime
import json
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from organphys.ground.atomic_file import write_text
from organphys.ground.checks import InputError

from .. import SCRIPTS
from .conditions import Condition

FORMAT = 1


@dataclass(frozen=True)
class RunKey:
    """Which run: names of case and method, and the condition."""

    case: str
    method: str
    condition: Condition

    def path(self, folder: Path) -> Path:
        """Where its file lies under the output ``folder``."""
        return folder / "runs" / self.case / self.method / f"{self.condition.text}.json"

    def is_done(self, folder: Path) -> bool:
        return self.path(folder).exists()

    def commit(self, folder: Path) -> str:
        """Of which commit the finished run is."""
        return str(json.loads(self.path(folder).read_text(encoding="utf-8"))["commit"])


def write_run(path: Path, key: RunKey, content: dict[str, Any]) -> None:
    """Write a finished run, also one that failed, atomically."""
    head = {"format": FORMAT, "case": key.case, "method": key.method, "condition": vars(key.condition)}
    head |= {"commit": commit(), "date": datetime.date.today().isoformat()}
    write_text(path, json.dumps({**head, **content}, allow_nan=True) + "\n")


def commit() -> str:
    """Short name of the checkout's commit."""
    command = ["git", "-C", str(SCRIPTS), "rev-parse", "--short", "HEAD"]
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return "unknown"


def read_runs(folder: Path) -> list[dict[str, Any]]:
    """All finished runs under the output ``folder``, by case, method and condition."""
    runs = []
    for path in sorted((folder / "runs").glob("*/*/*.json")):
        run = json.loads(path.read_text(encoding="utf-8"))
        if run.get("format") != FORMAT:
            raise InputError(f"{path}: made by another version of this benchmark; remove it to run it again")
        runs.append(run)
    return runs
