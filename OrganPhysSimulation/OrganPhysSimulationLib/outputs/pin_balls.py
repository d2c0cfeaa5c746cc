"""Pinned regions drawn as translucent balls and boxes."""

from __future__ import annotations

from typing import Any

import numpy as np
import vtk

from organphys.simulation.pins import AnyPin, BoxPin, Pin

from ..roles import ensure

COLOUR, OPACITY = (0.95, 0.80, 0.25), 0.3


def write_pin_balls(frame: Any, pins: tuple[AnyPin, ...], *, shown: bool = True) -> Any:
    """One model with a ball or a box for every pin, in mm of the simulation's frame."""
    node, together = ensure("pin_balls"), vtk.vtkAppendPolyData()
    for pin in pins:
        together.AddInputData(_ball(pin) if isinstance(pin, Pin) else _box(pin))
    if pins:
        together.Update()
    node.SetAndObserveMesh(together.GetOutput() if pins else vtk.vtkPolyData())
    node.SetAndObserveTransformNodeID(frame.GetID())
    display = node.GetDisplayNode()
    display.SetColor(*COLOUR)
    display.SetOpacity(OPACITY)
    display.SetVisibility(shown and bool(pins))
    return node


def _ball(pin: Pin) -> Any:
    ball = vtk.vtkSphereSource()
    ball.SetCenter(*(1e3 * x for x in pin.centre))
    ball.SetRadius(1e3 * pin.radius)
    ball.SetThetaResolution(24)
    ball.SetPhiResolution(16)
    ball.Update()
    return ball.GetOutput()


def _box(pin: BoxPin) -> Any:
    cube, matrix = vtk.vtkCubeSource(), np.eye(4)
    for set_length, side in zip((cube.SetXLength, cube.SetYLength, cube.SetZLength), pin.sides, strict=True):
        set_length(1e3 * side)
    matrix[:3, :3], matrix[:3, 3] = np.array(pin.axes).T, 1e3 * np.array(pin.centre)
    turn, turned = vtk.vtkTransform(), vtk.vtkTransformPolyDataFilter()
    turn.SetMatrix(matrix.ravel().tolist())
    turned.SetTransform(turn)
    turned.SetInputConnection(cube.GetOutputPort())
    turned.Update()
    return turned.GetOutput()
