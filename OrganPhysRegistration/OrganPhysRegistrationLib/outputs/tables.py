"""Tables of a case: the metrics with the warnings, and the numbers behind the plots."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import vtk
from vtk.util.numpy_support import numpy_to_vtk

from .case_record import STAGES, CaseNodes
from .node_factory import ensure
from .transform_nodes import transform_rows

COLUMNS = ("stage", "metric", "value", "unit")
WORDS = {"ct": "CT", "trim30": "nearest 70 %,"}
NO_UNIT = "no unit"


def write_metrics(case: CaseNodes) -> None:
    """Fill the metrics table: one row per figure, then the transforms, the times, and every warning in words."""
    record = case.record
    rows = [
        (stage, _words(name), _number(entry["value"]), _unit(str(entry["unit"])))
        for stage in STAGES
        for name, entry in record["metrics"].get(stage, {}).items()
    ]
    rows.append((record["stage"], "scale of the splat", _number(record["mm_per_unit"]), "mm per scene unit"))
    rows += [("transform", name, value, unit) for name, value, unit in transform_rows(case)]
    rows += [(part, "time", _number(seconds), "s") for part, seconds in record["seconds"].items()]
    rows += verdict_rows(record.get("verdict"))
    rows += [("warning", code.replace("_", " "), message, "") for code, message in record["notices"]]
    fill_table(ensure(case, "metrics"), dict(zip(COLUMNS, zip(*rows, strict=True), strict=True)))


def verdict_rows(verdict: Mapping[str, Any] | None) -> list[tuple[str, str, str, str]]:
    """The verdict and its reasons as rows of the metrics table; none before the elastic stage."""
    if not verdict:
        return []
    reasons = [("verdict", one["code"].replace("_", " "), one["message"], "") for one in verdict["reasons"]]
    return [("verdict", verdict["level"], verdict["headline"], ""), *reasons]


def fill_table(node: Any, columns: Mapping[str, Sequence[Any]]) -> None:
    """Give a table node new columns of numbers or of text."""
    table = vtk.vtkTable()
    for name, values in columns.items():
        table.AddColumn(_column(name, values))
    node.SetAndObserveTable(table)
    node.SetLocked(True)


def _column(name: str, values: Sequence[Any]) -> Any:
    if len(values) and isinstance(values[0], str):
        column = vtk.vtkStringArray()
        for value in values:
            column.InsertNextValue(value)
    else:
        column = numpy_to_vtk(np.ascontiguousarray(values, dtype=np.float64), deep=True)
    column.SetName(name)
    return column


def _number(value: Any) -> str:
    return f"{float(value):.4g}"


def _unit(unit: str) -> str:
    return NO_UNIT if unit == "1" else unit


def _words(name: str) -> str:
    return " ".join(WORDS.get(word, word) for word in name.split("_"))
