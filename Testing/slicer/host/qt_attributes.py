"""PythonQt's attribute rules on PySide6 objects.

Every Q_PROPERTY is a Python attribute (``widget.text``, ``widget.checked = True``), and an attribute that the C++ class
does not have cannot be set. Patches the PySide6 classes in place, so plain PySide6 code in the same process that calls
``widget.text()`` stops working: inside the host, properties are attributes everywhere.
"""

from __future__ import annotations

import inspect
import types
from typing import Any

from PySide6 import QtCore

from .qt_signals import connect, disconnect

QObject = QtCore.QObject
STAND_IN_PREFIXES = ("qMRML", "qSlicer", "ctk")
loading_ui = False  # QUiLoader of PySide6 sets every child as an attribute of the top widget


class QtProperty:
    """A Q_PROPERTY as an attribute of instances; on the class the getter (it may be static) stays callable."""

    def __init__(self, name: str, getter: Any) -> None:
        self.name, self.getter = name, getter
        self.setter = "set" + name[0].upper() + name[1:]
        self.is_static = isinstance(getter, staticmethod) or type(getter).__name__ == "builtin_function_or_method"

    def __get__(self, instance: Any, owner: Any = None) -> Any:
        if instance is None:
            return self if self.getter is None else self.getter.__get__(None, owner)
        if self.getter is None:
            return QObject.property(instance, self.name)
        if self.is_static:
            return getattr(self.getter, "__func__", self.getter)()
        return self.getter(instance)

    def __set__(self, instance: Any, value: Any) -> None:
        setter = getattr(type(instance), self.setter, None)
        if setter is not None:
            try:
                setter(instance, value)
                return
            except TypeError:  # an enumerator given as a number, for instance
                pass
        value = getattr(value, "value", value) if type(value).__module__.startswith("PySide6") else value
        if not QObject.setProperty(instance, self.name, value):
            raise TypeError(f"cannot set {type(instance).__name__}.{self.name} to {value!r}")


def patch_class(cls: type) -> None:
    """Give one PySide6 class its properties as attributes, and PythonQt's connect and setattr."""
    meta = cls.staticMetaObject
    for index in range(meta.propertyCount()):
        name = meta.property(index).name()
        getter = cls.__dict__.get(name)
        if isinstance(getter, (property, QtProperty)) or (index < meta.propertyOffset() and getter is None):
            continue
        if getter is None and any(isinstance(b.__dict__.get(name), QtCore.Signal) for b in cls.__mro__):
            continue
        if getter is None or inspect.isroutine(getter):
            setattr(cls, name, QtProperty(name, getter))
    _patch_getattribute(cls)
    if "__setattr__" in cls.__dict__:
        cls.__setattr__ = _set_attribute


def patch_base() -> None:
    """What every QObject has in PythonQt."""
    QObject.connect, QObject.disconnect = connect, disconnect
    QObject.name = property(lambda s: QObject.property(s, "objectName"), lambda s, value: s.setObjectName(value))
    QObject.className = lambda s: type(s).__name__
    QObject.delete = lambda s: s.deleteLater()
    QObject.__setattr__ = _set_attribute


def _patch_getattribute(cls: type) -> None:
    """Shiboken answers ``obj.connect`` from a C slot, ahead of the class dictionary: answer before it."""
    original = cls.__dict__.get("__getattribute__")
    if original is None:
        return

    def get_attribute(self: Any, name: str) -> Any:
        if name == "connect":
            return types.MethodType(connect, self)
        if name == "disconnect":
            return types.MethodType(disconnect, self)
        return original(self, name)

    cls.__getattribute__ = get_attribute


def _set_attribute(self: Any, name: str, value: Any) -> None:
    static = inspect.getattr_static(type(self), name, None)
    if isinstance(static, QtCore.Property):  # PySide6 handles these in C, not through __set__
        if static.fset is None:
            raise AttributeError(f"{type(self).__name__}.{name} is read-only")
        static.fset(self, value)
    elif hasattr(type(static), "__set__"):
        type(static).__set__(static, self, value)
    elif static is None and not loading_ui and _is_new_on_foreign(self, name):
        raise AttributeError(f"{type(self).__name__}.{name} does not exist; PythonQt allows no new attributes")
    else:
        self.__dict__[name] = value


def _is_new_on_foreign(instance: Any, name: str) -> bool:
    """Is this a new attribute on an object that is C++ in Slicer? The host's own begin with an underscore."""
    kind = type(instance)
    foreign = kind.__module__.startswith("PySide6") or kind.__name__.startswith(STAND_IN_PREFIXES)
    return foreign and not name.startswith("_") and name not in instance.__dict__
