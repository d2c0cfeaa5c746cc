"""Records of the simulator as a tree of plain values and a table of arrays, and back: for files, without pickle.

Only the record types named here are written or made; every field is kept, arrays with their bits and memory order, so
that a simulation taken from the tree goes on bit for bit as the one that was put in.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..asset.grid_spline import GridSpline
from ..basis.reproducing_kernel import ReproducingKernel
from ..basis.rkpm import RkpmWeights
from ..ground.checks import InputError
from ..ground.frames import Normalisation
from ..mechanics.tissue import Tissue
from .body import Body
from .contact_samples import ContactSamples
from .crushed_tissue import CrushedNeoHookean
from .elastic_modes import ModeSpace
from .local_detail import LocalDetail
from .local_functions import LocalFunctions
from .options import SimulationOptions
from .pins import BoxPin, Pin
from .quadrature import Cells, Quadrature
from .rest_shape import RestShape
from .sample_basis import SampleBasis
from .scene import Scene
from .session import PinEdit, Snapshot
from .simulation_basis import LocalColumns, SimulationBasis
from .state import BodyState, Grip, SceneState, ToolPose, Touch
from .strain_energy import StrainEnergy
from .tool_shapes import Capsule, GridShape
from .tools import Jaws, Part, Tool

RECORDS: dict[str, type[Any]] = {
    record.__name__: record
    for record in (
        *(
            Body,
            BodyState,
            BoxPin,
            Capsule,
            Cells,
            ContactSamples,
            CrushedNeoHookean,
            GridShape,
            GridSpline,
            Grip,
            Jaws,
            LocalColumns,
        ),
        *(LocalDetail, LocalFunctions, ModeSpace, Normalisation, Part, Pin, PinEdit, Quadrature),
        *(ReproducingKernel, RestShape, RkpmWeights, Scene, SceneState, SimulationBasis, SimulationOptions, Snapshot),
        *(StrainEnergy, Tissue, Tool, ToolPose, Touch),
    )
}
COMPUTED = {SampleBasis: "sample_basis"}  # made again from the record that holds it


class RecordTable:
    """The arrays of a tree by name, each once however often it is used."""

    def __init__(self) -> None:
        self.arrays: dict[str, np.ndarray] = {}
        self._names: dict[int, str] = {}
        self._kept: list[np.ndarray] = []  # an id stays an array's own as long as the array lives

    def tree(self, value: Any) -> Any:
        """``value`` as mappings, lists, numbers and texts; TypeError for a record of a type not named above."""
        if value is None or isinstance(value, (bool, int, str)):
            return value
        if isinstance(value, float):
            if not math.isfinite(value):
                raise TypeError(f"a number that is not finite ({value}) has no place in a record")
            return float(value)
        if isinstance(value, np.ndarray):
            return self._array(value)
        if type(value).__name__ in RECORDS and type(value) is RECORDS[type(value).__name__]:
            fields = {name: getattr(value, name) for name in field_names(type(value))}
            parts = {name: self.tree(part) for name, part in fields.items() if type(part) not in COMPUTED}
            return {"record": type(value).__name__, "fields": parts}
        if type(value) is tuple:
            return {"tuple": [self.tree(part) for part in value]}
        raise TypeError(f"{type(value).__name__} is no record that can be written")

    def _array(self, array: np.ndarray) -> dict[str, Any]:
        turned = array.ndim > 1 and array.flags.f_contiguous and not array.flags.c_contiguous
        if id(array) not in self._names:
            self._names[id(array)] = name = f"a/{len(self._names):06d}"
            self.arrays[name] = array.T if turned else array
            self._kept.append(array)
        return {"array": self._names[id(array)], **({"turned": True} if turned else {})}


def field_names(record: type[Any]) -> tuple[str, ...]:
    """Names of the fields of a dataclass or named tuple."""
    names: tuple[str, ...] = getattr(record, "_fields", ())
    return names or tuple(field.name for field in dataclasses.fields(record))


def record_of(tree: Any, arrays: Mapping[str, np.ndarray]) -> Any:
    """What ``RecordTable.tree`` was given; InputError for a tree that no such call made."""
    if not isinstance(tree, dict):
        return tree
    if "array" in tree:
        array = arrays[tree["array"]]
        return array.T if tree.get("turned") else array
    if "tuple" in tree:
        return tuple(record_of(part, arrays) for part in tree["tuple"])
    record = RECORDS.get(tree["record"])
    if record is None:
        raise InputError(f"record {str(tree['record'])[:40]!r} is not known")
    parts = {name: record_of(part, arrays) for name, part in tree["fields"].items()}
    if record is Body:
        plain = parts["plain"]
        parts["sample_basis"] = (
            SampleBasis(parts["basis"].phi, parts["basis"].size, parts["shape"].samples)
            if plain is None
            else plain.sample_basis
        )
    if set(parts) != set(field_names(record)):
        raise InputError(f"record {tree['record']} has other fields than in this version")
    return record(**parts)
