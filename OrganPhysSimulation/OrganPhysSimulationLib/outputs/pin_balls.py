"""Pinned regions drawn as translucent balls."""

from __future__ import annotations

from typing import Any

import vtk

from organphys.simulation.pins import Pin

from ..roles import ensure

COLOUR, OPACITY = (0.95, 0.80, 0.25), 0.3


def write_pin_balls(frame: Any, pins: tuple[Pin, ...], *, shown: bool = True) -> Any:
    """One model with a ball for every pin, in mm of the simulation's frame."""
    node, together = ensure("pin_balls"), vtk.vtkAppendPolyData()
    for pin in pins:
        ball = vtk.vtkSphereSource()
        ball.SetCenter(*(1e3 * x for x in pin.centre))
        ball.SetRadius(1e3 * pin.radius)
        ball.SetThetaResolution(24)
        ball.SetPhiResolution(16)
        ball.Update()
        together.AddInputData(ball.GetOutput())
    if pins:
        together.Update()
    node.SetAndObserveMesh(together.GetOutput() if pins else vtk.vtkPolyData())
    node.SetAndObserveTransformNodeID(frame.GetID())
    display = node.GetDisplayNode()
    display.SetColor(*COLOUR)
    display.SetOpacity(OPACITY)
    display.SetVisibility(shown and bool(pins))
    return node
