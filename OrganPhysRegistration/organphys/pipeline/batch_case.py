"""One case of a batch on one worker: locked, skipped where it is finished, done whole or not at all."""

from __future__ import annotations

import argparse
import time
import traceback
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..ground.atomic_file import write_text
from ..ground.progress import no_progress
from .batch_folder import CaseFolder
from .batch_lock import case_lock
from .batch_records import BUSY, DONE, FAILED, KEPT, BatchCase, Outcome, Work
from .command_line import message_of
from .processor import one_blas_thread
from .provenance import provenance_of

if TYPE_CHECKING:
    from .registration import Registration


@one_blas_thread
def work_case(case: BatchCase, out: Path, work: Work, *, wait: bool = False) -> Outcome:
    """Do ``case`` unless it is finished; ``wait``: for someone else who is at it. Any failure becomes an outcome."""
    folder = CaseFolder(out, case.name)
    try:
        with case_lock(folder.lock, wait=wait) as held:
            return _worked(case, folder, work) if held else Outcome(BUSY)
    except Exception as error:  # the border between a case and the others: none may stop them
        return _failed(folder, error)


def _worked(case: BatchCase, folder: CaseFolder, work: Work) -> Outcome:
    folder.mend()
    try:
        begin, inputs = time.perf_counter(), provenance_of(case.arguments)
        record = folder.finished(inputs)
        if record is not None:
            return Outcome(KEPT, record["seconds"], record["result"])
        result = work(case.arguments, folder.begin())
        record = folder.publish(inputs, result, time.perf_counter() - begin)
        return Outcome(DONE, record["seconds"], record["result"])
    finally:
        folder.mend()


def _failed(folder: CaseFolder, error: Exception) -> Outcome:
    """The error in one line; its traceback goes to errors/NAME.txt."""
    message = message_of(error) if isinstance(error, (ValueError, OSError, MemoryError)) else None
    if message is None:
        words = " ".join(str(error).split())
        message = f"error of the program, {type(error).__name__}: {words}; see {folder.error_file}"
    write_text(folder.error_file, "".join(traceback.format_exception(error)))
    return Outcome(FAILED, error=message)


def register_case(arguments: argparse.Namespace, folder: Path) -> Mapping[str, Any]:
    """The work of ``organphys register``, which is loaded when the first case comes to it."""
    from .commands_register import register_files
    from .write_outputs import write_outputs

    registration = register_files(arguments, no_progress)
    write_outputs(registration, folder)
    return figures(registration)


METRICS = {
    "splat to organ, nearest 70 % [mm]": "trim30_splat_to_ct",
    "error radius 95 %, seen [mm]": "error_95_visible",
    "error radius 95 %, unseen [mm]": "error_95_hidden",
    "volume drift [%]": "volume_drift",
    "smallest det F": "min_det_F",
}


def figures(registration: Registration) -> dict[str, Any]:
    """What the summary tells of a registration: verdict, metrics of the last stage, scale, codes of the warnings."""
    elastic = registration.metrics["elastic"]
    metrics = {name: float(elastic[key]["value"]) if key in elastic else None for name, key in METRICS.items()}
    return {
        "verdict": None if registration.verdict is None else registration.verdict.level,
        **metrics,
        "scale [mm per scene unit]": registration.organ.mm_per_unit,
        "warnings": " ".join(notice.code for notice in registration.notices),
    }
