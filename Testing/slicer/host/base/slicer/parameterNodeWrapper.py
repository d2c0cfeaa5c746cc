"""``@parameterNodeWrapper`` for flat parameters: scalars, enumerations, node references; two-way to widgets."""

from __future__ import annotations

import typing
from typing import Any

import qt
import vtk
from slicer.parameter_types import Choice, Decimals, Default, Maximum, Minimum, Parameter, SingleStep, WithinRange
from slicer.parameter_widgets import connection

__all__ = [
    "Choice",
    "Decimals",
    "Default",
    "Maximum",
    "Minimum",
    "SingleStep",
    "SlicerParameterNamePropertyName",
    "WithinRange",
    "parameterNodeWrapper",
]
SlicerParameterNamePropertyName = "SlicerParameterName"


class _Wrapper:
    """What the decorator adds to a class of annotated parameters."""

    def __init__(self, parameterNode: Any, prefix: Any = None) -> None:
        self.parameterNode, self._connected, self._updating = parameterNode, {}, False
        for parameter in self._parameters.values():
            if not parameter.is_in(parameterNode):
                parameter.write(parameterNode, parameter.default)

    def connectGui(self, gui: Any) -> int:
        """Connect every widget that has the property SlicerParameterName; the tag undoes it (``disconnectGui``)."""
        widgets = gui.findChildren(qt.QWidget) if hasattr(gui, "findChildren") else list(vars(gui).values())
        widgets = [w for w in widgets if isinstance(w, qt.QWidget)]
        named = {w.property(SlicerParameterNamePropertyName): w for w in widgets}
        named.pop(None, None)
        return self.connectParametersToGui(named)

    def connectParametersToGui(self, mapping: dict[str, Any]) -> int:
        made = []
        for name, widget in mapping.items():
            parameter = self._parameters[name]
            signal, read, write = connection(widget, parameter)
            write(parameter.read(self.parameterNode))
            slot = self._writer(parameter, read)
            signal.connect(slot)
            made.append((parameter, signal, write, slot))
        tag = len(self._connected) + 1
        observer = self.AddObserver(vtk.vtkCommand.ModifiedEvent, lambda *_: self._update_gui(tag))
        self._connected[tag] = (made, observer)
        return tag

    def disconnectGui(self, tag: int) -> None:
        made, observer = self._connected.pop(tag, ([], None))
        for _parameter, signal, _write, slot in made:
            signal.disconnect(slot)
        if observer is not None:
            self.RemoveObserver(observer)

    def _writer(self, parameter: Parameter, read: Any) -> Any:
        def on_changed(*_values: Any) -> None:
            if not self._updating:
                parameter.write(self.parameterNode, read())

        return on_changed

    def _update_gui(self, tag: int) -> None:
        if self._updating:
            return
        self._updating = True
        try:
            for parameter, _signal, write, _slot in self._connected[tag][0]:
                write(parameter.read(self.parameterNode))
        finally:
            self._updating = False

    def default(self, name: str) -> Any:
        return self._parameters[name].default

    def getValue(self, name: str) -> Any:
        return self._parameters[name].read(self.parameterNode)

    def setValue(self, name: str, value: Any) -> None:
        self._parameters[name].write(self.parameterNode, value)

    def AddObserver(self, event: Any, callback: Any, priority: float = 0.0) -> int:
        return self.parameterNode.AddObserver(event, callback, priority)

    def RemoveObserver(self, tag: int) -> None:
        self.parameterNode.RemoveObserver(tag)

    def HasObserver(self, tag: int) -> bool:
        return bool(self.parameterNode.HasObserver(tag))

    def StartModify(self) -> int:
        return self.parameterNode.StartModify()

    def EndModify(self, was_modifying: int) -> None:
        self.parameterNode.EndModify(was_modifying)

    def Modified(self) -> None:
        self.parameterNode.Modified()


def parameterNodeWrapper(cls: type | None = None) -> Any:
    if cls is None:
        return parameterNodeWrapper
    hints = typing.get_type_hints(cls, include_extras=True)
    cls._parameters = {name: Parameter(cls, name, hint) for name, hint in hints.items()}
    for name, member in vars(_Wrapper).items():
        if callable(member):
            setattr(cls, name, member)
    for parameter in cls._parameters.values():
        setattr(cls, parameter.name, _property(parameter))
    return cls


def _property(parameter: Parameter) -> property:
    return property(
        lambda self: parameter.read(self.parameterNode),
        lambda self, value: parameter.write(self.parameterNode, value),
    )
