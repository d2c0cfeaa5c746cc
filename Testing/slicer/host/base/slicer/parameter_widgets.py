"""How a widget and a parameter talk: the signal of a change, reading the widget, writing the widget."""

from __future__ import annotations

import enum
from collections.abc import Callable
from typing import Any

from slicer.parameter_types import Choice, Decimals, Maximum, Minimum, Parameter, SingleStep, WithinRange

Connection = tuple[Any, Callable[[], Any], Callable[[Any], None]]


def connection(widget: Any, parameter: Parameter) -> Connection:
    """(signal, read, write) for one widget; RuntimeError where the test host knows no way."""
    names = {cls.__name__ for cls in type(widget).__mro__}
    if parameter.is_node:
        return _node(widget, parameter, names)
    if parameter.base is bool:
        return widget.toggled, lambda: widget.checked, lambda value: setattr(widget, "checked", bool(value))
    if "QComboBox" in names:
        return _combo(widget, parameter)
    if parameter.base in (int, float):
        return _number(widget, parameter)
    if "QLineEdit" in names:
        return widget.textChanged, lambda: widget.text, lambda v: None if widget.text == v else widget.setText(v)
    raise RuntimeError(f"no connection between parameter {parameter.name} and {type(widget).__name__}")


def _node(widget: Any, parameter: Parameter, names: set[str]) -> Connection:
    signal = widget.currentNodeChanged
    if "qMRMLNodeComboBox" in names:
        widget.nodeTypes = [parameter.base.__name__]
    return signal, widget.currentNode, widget.setCurrentNode


def _combo(widget: Any, parameter: Parameter) -> Connection:
    choices = parameter.note(Choice)
    values = list(choices[0]) if choices else list(parameter.base)
    widget.clear()
    label = getattr(parameter.base, "label", lambda value: value.name if isinstance(value, enum.Enum) else str(value))
    widget.addItems([label(value) for value in values])
    return (
        widget.currentIndexChanged,
        lambda: values[widget.currentIndex],
        lambda value: widget.setCurrentIndex(values.index(value)),
    )


def _number(widget: Any, parameter: Parameter) -> Connection:
    limits = parameter.note(WithinRange)
    low = limits[0] if limits else (parameter.note(Minimum) or (None,))[0]
    high = limits[1] if limits else (parameter.note(Maximum) or (None,))[0]
    settings = {"maximum": high, "minimum": low}
    settings["decimals"] = (parameter.note(Decimals) or (None,))[0]
    settings["singleStep"] = (parameter.note(SingleStep) or (None,))[0]
    for name, value in settings.items():
        if value is not None:
            setattr(widget, name, value)
    return widget.valueChanged, lambda: parameter.base(widget.value), lambda value: widget.setValue(value)
