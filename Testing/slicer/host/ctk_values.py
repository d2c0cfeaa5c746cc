"""Stand-ins for ctk's and qMRML's numeric widgets: slider with spin box, spin box."""

from __future__ import annotations

from typing import Any

from PySide6 import QtCore, QtWidgets
from PySide6.QtCore import Property, Signal

from .stand_in import held, parent_of, row_layout
from .ui_loader import stand_in

SLIDER_STEPS = 1000


class NumberWidget(QtWidgets.QWidget):
    """Slider and spin box that share one number."""

    valueChanged = Signal(float)
    valueIsChanging = Signal(float)
    mrmlSceneChanged = Signal(object)

    def __init__(self, *arguments: Any) -> None:
        super().__init__(parent_of(arguments))
        self._low, self._high, self._value, self._step, self._digits, self._syncing = 0.0, 99.0, 0.0, 1.0, 2, False
        self._slider, self._spin = QtWidgets.QSlider(QtCore.Qt.Horizontal), QtWidgets.QDoubleSpinBox()
        self._slider.setRange(0, SLIDER_STEPS)
        self._spin.setMinimumWidth(92)
        layout = row_layout(self)
        layout.addWidget(self._slider, 1)
        layout.addWidget(self._spin)
        self._spin.valueChanged.connect(self._on_spin)
        self._slider.valueChanged.connect(self._on_slider)
        self._sync()

    def _on_spin(self, value: float) -> None:
        if not self._syncing:
            self.setValue(value)

    def _on_slider(self, position: int) -> None:
        if not self._syncing:
            self.setValue(self._low + (self._high - self._low) * position / SLIDER_STEPS)

    def _sync(self) -> None:
        self._syncing = True
        self._spin.setDecimals(self._digits)
        self._spin.setRange(self._low, self._high)
        self._spin.setSingleStep(self._step)
        self._spin.setValue(self._value)
        span = self._high - self._low
        self._slider.setValue(round(SLIDER_STEPS * (self._value - self._low) / span) if span > 0 else 0)
        self._syncing = False

    def setValue(self, value: float) -> None:
        value = round(min(max(float(value), self._low), self._high), self._digits)
        changed, self._value = value != self._value, value
        self._sync()
        if changed:
            self.valueIsChanging.emit(value)
            self.valueChanged.emit(value)

    def setMinimum(self, low: float) -> None:
        self.setRange(low, max(self._high, low))

    def setMaximum(self, high: float) -> None:
        self.setRange(min(self._low, high), high)

    def setRange(self, low: float, high: float) -> None:
        self._low, self._high = float(low), float(high)
        self.setValue(self._value)

    def setSingleStep(self, step: float) -> None:
        self._step = float(step)
        self._sync()

    def setDecimals(self, digits: int) -> None:
        self._digits = int(digits)
        self._sync()

    def setMRMLScene(self, scene: Any) -> None:
        self.mrmlSceneChanged.emit(scene)

    value = Property(float, lambda self: self._value, setValue)
    minimum = Property(float, lambda self: self._low, setMinimum)
    maximum = Property(float, lambda self: self._high, setMaximum)
    singleStep = Property(float, lambda self: self._step, setSingleStep)
    decimals = Property(int, lambda self: self._digits, setDecimals)
    suffix = Property(str, lambda self: self._spin.suffix, lambda self, text: self._spin.setSuffix(text))
    prefix = Property(str, lambda self: self._spin.prefix, lambda self, text: self._spin.setPrefix(text))
    specialValueText = Property(
        str, lambda self: self._spin.specialValueText, lambda self, text: self._spin.setSpecialValueText(text)
    )
    pageStep = held(float, "pageStep", 10.0)
    tickInterval = held(float, "tickInterval", 0.0)
    tracking = held(bool, "tracking", True)
    quantity = held(str, "quantity", "")
    unitAwareProperties = held(int, "unitAwareProperties", 0)
    decimalsOption = held(int, "decimalsOption", 0)


class SpinWidget(NumberWidget):
    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self._slider.hide()
        self.layout().setStretchFactor(self._spin, 1)


for _name, _base in {
    "ctkSliderWidget": NumberWidget,
    "qMRMLSliderWidget": NumberWidget,
    "ctkDoubleSpinBox": SpinWidget,
    "qMRMLSpinBox": SpinWidget,
}.items():
    globals()[_name] = stand_in(type(_name, (_base,), {}))
