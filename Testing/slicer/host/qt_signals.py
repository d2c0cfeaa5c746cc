"""PythonQt's ``obj.connect("clicked(bool)", f)``: signals by signature, arguments cut to what the slot takes."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

from PySide6 import QtCore

# Overloads of Qt 5 that have a name of their own in Qt 6.
RENAMED = {
    "currentIndexChanged(QString)": "currentTextChanged",
    "activated(QString)": "textActivated",
    "buttonClicked(int)": "idClicked",
    "valueChanged(QString)": "textChanged",
}


def connect(self: QtCore.QObject, signal: str, *slot: Any) -> bool:
    """``connect(signal, callable)`` or ``connect(signal, receiver, "slot()")``."""
    if not isinstance(signal, str):
        raise TypeError("connect(signal, callable): signal must be a string such as 'clicked(bool)'")
    function = slot[0] if len(slot) == 1 else getattr(slot[0], str(slot[1]).partition("(")[0])
    if not callable(function):
        raise TypeError(f"connect({signal!r}): the slot is not callable: {function!r}")
    bound, count = _bound_signal(self, signal)
    call = _cut_arguments(function, count)
    bound.connect(call)
    self.__dict__.setdefault("_connections", []).append((_squeezed(signal), function, bound, call))
    return True


def disconnect(self: QtCore.QObject, signal: str | None = None, *slot: Any) -> bool:
    """Undo ``connect``; without a slot, all connections of the signal."""
    made = self.__dict__.get("_connections", [])
    hits = [c for c in made if (signal is None or c[0] == _squeezed(signal)) and (not slot or c[1] == slot[-1])]
    for connection in hits:
        connection[2].disconnect(connection[3])
        made.remove(connection)
    return bool(hits)


def _squeezed(signal: str) -> str:
    return signal.replace(" ", "")


def _bound_signal(owner: QtCore.QObject, text: str) -> tuple[Any, int | None]:
    """The signal of ``owner`` and how many arguments the signature names (None: it names none)."""
    name, _, rest = text.partition("(")
    count = len([a for a in rest.rstrip(")").split(",") if a.strip()]) if rest else None
    renamed = RENAMED.get(_squeezed(text))
    name = renamed if renamed and hasattr(type(owner), renamed) else name.strip()
    if not isinstance(inspect.getattr_static(type(owner), name, None), QtCore.Signal):
        raise ValueError(f"{type(owner).__name__} has no signal {text}")
    return getattr(owner, name), count


def _cut_arguments(function: Callable[..., Any], count: int | None) -> Callable[..., Any]:
    takes = _positional_count(function)

    def call(*arguments: Any) -> Any:
        return function(*arguments[:count][:takes])

    return call


def _positional_count(function: Callable[..., Any]) -> int | None:
    try:
        parameters = inspect.signature(function).parameters.values()
    except (TypeError, ValueError):  # a method of C++: it takes what it is given
        return None
    if any(p.kind is p.VAR_POSITIONAL for p in parameters):
        return None
    return sum(p.kind in (p.POSITIONAL_ONLY, p.POSITIONAL_OR_KEYWORD) for p in parameters)
