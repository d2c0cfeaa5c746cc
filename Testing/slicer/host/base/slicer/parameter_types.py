"""One parameter of a parameter node: its type, its checks, how it is written to the node."""

from __future__ import annotations

import enum
import json
import pathlib
import types
import typing
from typing import Any

import slicer

SCALARS = (int, float, str, bool, list, dict, tuple)


class Note:
    """An annotation such as ``WithinRange(0, 1)``."""

    def __init__(self, *arguments: Any) -> None:
        self.arguments = arguments

    def check(self, value: Any) -> None: ...


class WithinRange(Note):
    def check(self, value: Any) -> None:
        if not self.arguments[0] <= value <= self.arguments[1]:
            raise ValueError(f"{value} is not within {self.arguments}")


class Minimum(Note):
    def check(self, value: Any) -> None:
        if value < self.arguments[0]:
            raise ValueError(f"{value} is below {self.arguments[0]}")


class Maximum(Note):
    def check(self, value: Any) -> None:
        if value > self.arguments[0]:
            raise ValueError(f"{value} is above {self.arguments[0]}")


class Choice(Note):
    def check(self, value: Any) -> None:
        if value not in self.arguments[0]:
            raise ValueError(f"{value!r} is not one of {self.arguments[0]}")


class Default(Note): ...


class Decimals(Note): ...


class SingleStep(Note): ...


class Parameter:
    """``name: hint`` of a wrapper class; Enum members are stored by name, nodes as references, the rest as JSON."""

    def __init__(self, owner: type, name: str, hint: Any) -> None:
        self.name, self.notes = name, []
        if typing.get_origin(hint) is typing.Annotated:
            hint, *self.notes = typing.get_args(hint)
        self.optional = typing.get_origin(hint) in (typing.Union, types.UnionType)
        if self.optional:
            (hint,) = [t for t in typing.get_args(hint) if t is not type(None)]
        self.hint, self.base = hint, typing.get_origin(hint) or hint
        self.is_node = issubclass(self.base, slicer.vtkMRMLNode)
        if not self.is_node and not issubclass(self.base, (*SCALARS, pathlib.PurePath, enum.Enum)):
            raise TypeError(f"parameter {name}: the test host does not know the type {hint}")
        self.default = getattr(owner, name) if hasattr(owner, name) else self._default()

    def note(self, kind: type) -> tuple[Any, ...] | None:
        """The arguments of the annotation of this kind."""
        return next((n.arguments for n in self.notes if isinstance(n, kind)), None)

    def _default(self) -> Any:
        given = self.note(Default)
        if given:
            return given[0]
        if self.is_node or self.optional:
            return None
        return next(iter(self.base)) if issubclass(self.base, enum.Enum) else self.base()

    def is_in(self, node: Any) -> bool:
        return bool(node.GetNodeReferenceID(self.name) if self.is_node else node.GetParameter(self.name))

    def check(self, value: Any) -> None:
        if value is None and (self.optional or self.is_node):
            return
        kinds = (int, float) if self.base is float else self.base
        if not isinstance(value, kinds):
            raise ValueError(f"{self.name}: {value!r} is not {self.base.__name__}")
        for note in self.notes:
            if isinstance(note, Note):
                note.check(value)

    def write(self, node: Any, value: Any) -> None:
        self.check(value)
        if self.is_node:
            node.SetNodeReferenceID(self.name, value.GetID() if value is not None else None)
            return
        plain = value.name if isinstance(value, enum.Enum) else value
        node.SetParameter(self.name, json.dumps(str(plain) if isinstance(plain, pathlib.PurePath) else plain))

    def read(self, node: Any) -> Any:
        if self.is_node:
            return node.GetNodeReference(self.name)
        text = node.GetParameter(self.name)
        value = json.loads(text) if text else self.default
        if value is None or not text:
            return value
        return self.base[value] if issubclass(self.base, enum.Enum) else self.base(value)
