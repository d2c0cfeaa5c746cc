"""A followed organ in the scene: a sequence of its surface and one of its similarity, and a browser to play them."""

from __future__ import annotations

import json
from collections.abc import Generator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import slicer

from organphys.ground.checks import InputError

from ..inputs.matrices import matrix_of, to_parent
from ..inputs.splat_scale import scene_to_world
from .geometry import cells, smooth_normals, triangle_mesh
from .node_factory import remove

CLASSES = ("vtkMRMLSequenceNode", "vtkMRMLSequenceBrowserNode")
FILE = "OrganPhys.SequenceFile"
COLOUR = (0.35, 0.75, 1.0)


@dataclass(frozen=True)
class SequenceNodes:
    """browser: plays all; surfaces, transforms: sequence nodes; surface, ct_to_scene: the nodes that are shown, which
    change with the browser; facts: times, status and notices of the frames."""

    browser: Any
    surfaces: Any
    transforms: Any
    surface: Any
    ct_to_scene: Any
    facts: dict[str, Any]


def check_sequences() -> None:
    """InputError where this Slicer has no sequences."""
    if not all(hasattr(slicer, name) for name in CLASSES) or not hasattr(slicer.modules, "sequences"):
        raise InputError("sequence: this Slicer lacks the Sequences module; enable it under Edit, Application Settings")


def sequence_steps(folder: Path, splat: Any, name: str) -> Generator[None, None, SequenceNodes]:
    """Make the nodes of what ``follow`` left in ``folder``, one frame a step; given up, nothing is left."""
    check_sequences()
    scene, facts = splat.GetScene(), json.loads((folder / "sequence.json").read_text(encoding="utf-8"))
    made: list[Any] = []
    try:
        surfaces, transforms = (_sequence(scene, f"{name} {what}", facts, made) for what in ("surfaces", "CT to scene"))
        triangles = cells(np.load(folder / "faces.npy", allow_pickle=False))
        for k, time in enumerate(facts["times"]):
            _add_surface(surfaces, np.load(folder / f"frame_{k}.npy", allow_pickle=False), triangles, time)
            _add_transform(transforms, to_parent(scene_to_world(splat)) @ np.array(facts["T_scene_ct"][k]), time)
            yield
        return _played(scene, splat, name, surfaces, transforms, facts, made)
    except BaseException:
        for node in reversed(made):
            if scene.IsNodePresent(node):
                remove(scene, node)
        raise


def _sequence(scene: Any, name: str, facts: dict[str, Any], made: list[Any]) -> Any:
    node = scene.AddNewNodeByClass("vtkMRMLSequenceNode", name)
    made.append(node)
    node.SetIndexName("time" if facts["time_unit"] == "s" else "frame")
    node.SetIndexUnit("s" if facts["time_unit"] == "s" else "")
    node.SetIndexType(slicer.vtkMRMLSequenceNode.NumericIndex)
    return node


def _add_surface(sequence: Any, points: Any, triangles: Any, time: float) -> None:
    """Points (V, 3) in scene units: the shown model stands under the splat's transform."""
    model = slicer.vtkMRMLModelNode()
    model.SetAndObserveMesh(triangle_mesh(points, triangles, smooth_normals(points, triangles)))
    sequence.SetDataNodeAtValue(model, f"{time:.6g}")


def _add_transform(sequence: Any, matrix: Any, time: float) -> None:
    transform = slicer.vtkMRMLLinearTransformNode()
    transform.SetMatrixTransformToParent(matrix_of(matrix))
    sequence.SetDataNodeAtValue(transform, f"{time:.6g}")


def _played(
    scene: Any, splat: Any, name: str, surfaces: Any, transforms: Any, facts: dict[str, Any], made: list[Any]
) -> SequenceNodes:
    browser = scene.AddNewNodeByClass("vtkMRMLSequenceBrowserNode", f"{name} browser")
    made.append(browser)
    for sequence in (surfaces, transforms):
        browser.AddSynchronizedSequenceNode(sequence)
    steps = np.diff(facts["times"])
    browser.SetPlaybackRateFps(float(np.clip(1 / np.median(steps), 1, 30)) if facts["time_unit"] == "s" else 5.0)
    logic = slicer.modules.sequences.logic()
    logic.UpdateProxyNodesFromSequences(browser)
    surface, ct_to_scene = browser.GetProxyNode(surfaces), browser.GetProxyNode(transforms)
    made += [surface, ct_to_scene]
    surface.SetName(f"{name} surface (followed)")
    ct_to_scene.SetName(f"{name} CT to scene (followed)")
    surface.SetAndObserveTransformNodeID(splat.GetTransformNodeID())
    ct_to_scene.SetAndObserveTransformNodeID(scene_to_world(splat).GetTransformNodeID())
    surface.CreateDefaultDisplayNodes()
    surface.GetDisplayNode().SetColor(*COLOUR)
    surface.GetDisplayNode().SetOpacity(0.6)
    return SequenceNodes(browser, surfaces, transforms, surface, ct_to_scene, facts)
