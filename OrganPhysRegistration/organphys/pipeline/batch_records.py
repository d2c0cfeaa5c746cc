"""What a batch is made of: the cases asked for, and what became of them."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

DONE, KEPT, FAILED, NOT_RUN = "done", "finished before", "failed", "not run"
BUSY, DIED = "held by another batch", "worker died"  # on the way: the case is asked for again

Work = Callable[[argparse.Namespace, Path], Mapping[str, Any]]
"""Writes a case's files into an empty folder and returns what the summary tells of it: names with units and values."""


@dataclass(frozen=True)
class BatchCase:
    """One line of the table: the case's name, the line's number, and what ``organphys register`` would get."""

    name: str
    line: int
    arguments: argparse.Namespace


@dataclass(frozen=True)
class Outcome:
    """What became of a case: ``status`` is DONE, KEPT, FAILED or NOT_RUN; ``seconds`` of its work; ``result``: names
    with units and values; ``error``: one line."""

    status: str
    seconds: float | None = None
    result: Mapping[str, Any] = field(default_factory=dict)
    error: str = ""
