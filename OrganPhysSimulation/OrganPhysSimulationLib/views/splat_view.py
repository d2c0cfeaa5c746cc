"""The moving splat in all 3D views: actors of our own in the views' renderers, re-ordered when a camera turns."""

from __future__ import annotations

import functools
from typing import Any

import slicer
import vtk

from organphys.ground.checks import Array
from organphys.simulation.body import Body
from organphys.simulation.quick_splat import QuickSplat
from OrganPhysRegistrationLib.inputs.splat_node import T_shown_scene

from ..inputs.splat_input import node_arrays, shown_rows
from .gaussian_actor import GaussianActor
from .splat_cloud import SplatCloud


class SplatView:
    """Draws the Gaussians of a splat node, whose own points are hidden meanwhile, until ``remove``."""

    def __init__(self, splat: Any) -> None:
        self._splat = splat
        self._cloud = SplatCloud(node_arrays(splat), shown_rows(splat))
        self._cloud.place(T_shown_scene(splat))
        self._last: tuple[QuickSplat, Body, Array] | None = None
        self._actors: list[GaussianActor] = []
        self._tags: list[tuple[Any, int]] = []
        self._view_tags: list[tuple[Any, int]] = []
        self._visible_before = bool(splat.GetDisplayNode().GetVisibility())
        self._observe(splat, slicer.vtkMRMLTransformableNode.TransformModifiedEvent, self._placed)
        self._shown = False

    @property
    def shown(self) -> bool:
        return self._shown

    @property
    def cloud(self) -> SplatCloud:
        return self._cloud

    def show(self, shown: bool) -> None:
        """Draw the Gaussians instead of the node's points, or nothing of the splat."""
        if shown and not self._shown and self._last is not None:
            self._cloud.follow(*self._last)  # it moved on unseen
        self._shown = shown
        self._splat.GetDisplayNode().SetVisibility(False)
        self._refresh()

    def follow(self, binding: QuickSplat | None, body: Body, z: Array) -> None:
        """Show the splat as it is at Z (n, 3) of ``body``."""
        if binding is None:
            return
        self._last = (binding, body, z)
        if self._shown:
            self._cloud.follow(binding, body, z)
            self._refresh()

    def remove(self) -> None:
        """Take everything out of the views; the node's points are shown again as before."""
        for caller, tag in self._tags:
            caller.RemoveObserver(tag)
        self._tags = []
        self._remove_actors()
        display = self._splat.GetDisplayNode()
        if display is not None and self._splat.GetScene() is not None:
            display.SetVisibility(self._visible_before)
        _render()

    def _refresh(self) -> None:
        renderers = _renderers()
        if self._shown and [actor.renderer for actor in self._actors] != renderers:  # also when the layout changed
            self._remove_actors()
            self._add_actors(renderers)
        for actor in self._actors:
            actor.actor.SetVisibility(self._shown)
            if self._shown:
                actor.update()
        _render()

    def _add_actors(self, renderers: list[Any]) -> None:
        for renderer in renderers:
            actor = GaussianActor(renderer, self._cloud)
            call = functools.partial(self._reorder, actor)
            self._actors.append(actor)
            self._view_tags.append((renderer, renderer.AddObserver(vtk.vtkCommand.StartEvent, call)))

    def _remove_actors(self) -> None:
        for caller, tag in self._view_tags:
            caller.RemoveObserver(tag)
        for actor in self._actors:
            actor.remove()
        self._view_tags, self._actors = [], []

    def _reorder(self, actor: GaussianActor, *_event: Any) -> None:
        """Called before a view is drawn."""
        if self._shown and actor.camera_moved():
            actor.update()

    def _placed(self, *_event: Any) -> None:
        """The splat was moved or rescaled."""
        self._cloud.place(T_shown_scene(self._splat))
        if self._last is not None:
            self._cloud.follow(*self._last)
        self._refresh()

    def _observe(self, caller: Any, event: Any, call: Any) -> None:
        self._tags.append((caller, caller.AddObserver(event, call)))


def _views() -> list[Any]:
    manager = slicer.app.layoutManager()
    return [] if manager is None else [manager.threeDWidget(k).threeDView() for k in range(manager.threeDViewCount)]


def _renderers() -> list[Any]:
    return [view.renderWindow().GetRenderers().GetFirstRenderer() for view in _views()]


def _render() -> None:
    for view in _views():
        view.scheduleRender()
