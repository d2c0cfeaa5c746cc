"""A known result of a registration: the core tests' bent ellipsoid, as the stages hand it over, with its nodes."""

from __future__ import annotations

import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import slicer
import vtk
from vtk.util.numpy_support import numpy_to_vtk

from organphys.asset.asset_file import asset_bytes
from organphys.exports.displacement_grid import DisplacementGrid, DisplacementGrids
from organphys.ground.frames import Similarity
from organphys.pipeline.case_outcome import CaseOutcome
from OrganPhysRegistrationLib.inputs.matrices import matrix_of
from OrganPhysRegistrationLib.inputs.splat_columns import SplatColumns
from OrganPhysRegistrationLib.inputs.splat_node import polydata_of
from OrganPhysRegistrationLib.inputs.splat_scale import set_scale

sys.path.append(str(Path(__file__).resolve().parents[1] / "core"))
from asset_examples import bent_organ

ERROR = {"max": 0.04, "p95": 0.02}
LINEAR_ERROR = {"max": 0.07, "p95": 0.03}


@cache
def organ():
    """Registered organ, bent by up to 9 mm."""
    return bent_organ()


@cache
def grids(spacing: float = 3.0) -> DisplacementGrids:
    """Forward and inverse displacement, sampled here, 40 mm beyond the organ."""
    bent = organ()
    low = bent.vertices.min(0) - 40
    count = np.ceil((bent.vertices.max(0) + 40 - low) / spacing).astype(int) + 1
    x, y, z = (low[k] + spacing * np.arange(count[k]) for k in range(3))
    k, j, i = np.meshgrid(z, y, x, indexing="ij")
    places = np.stack([i, j, k], axis=-1).reshape(-1, 3)
    shape, step = (*count[::-1], 3), np.full(3, spacing)
    there = bent.deformation.displacement(places)
    back = bent.inverse_map_points(bent.T_scene_ct.apply(places)) - places
    return DisplacementGrids(
        *(
            DisplacementGrid(low, step, u.reshape(shape).astype(np.float32), ERROR, ERROR, LINEAR_ERROR)
            for u in (there, back)
        )
    )


def outcome(stage: str = "elastic", *, shift_mm: float = 0.0, sampled: bool = True, **changes) -> CaseOutcome:
    """The case after a stage. ``shift_mm`` moves the coarse pose; ``sampled``: the grids are there already."""
    bent = organ()
    elastic = bent.T_scene_ct
    coarse = Similarity(elastic.scale * 1.05, elastic.rotation, elastic.translation + 0.01 * (8 + shift_mm))
    rigid = Similarity(elastic.scale, elastic.rotation, elastic.translation + 0.02)
    before = Similarity(elastic.scale, np.eye(3), np.array([0.0, 0, 1]))
    poses = {"before": before, "coarse": coarse, "rigid": rigid, "elastic": elastic}
    kept = list(poses)[: list(poses).index(stage) + 1]
    poses = {name: poses[name] for name in kept}
    surfaces = {name: T.apply(bent.vertices) for name, T in poses.items()}
    true = bent.scene_vertices
    figure = {"mean_ct_to_splat": {"value": 1.234567, "unit": "mm"}, "min_det_F": {"value": 0.9, "unit": "1"}}
    base = CaseOutcome(
        stage=stage,
        similarities={name: T.matrix for name, T in poses.items()},
        vertices_ct=bent.vertices,
        faces=bent.faces,
        surfaces=surfaces,
        distance_mm={name: np.linalg.norm(at - true, axis=1) / elastic.scale for name, at in surfaces.items()},
        mm_per_unit=1 / poses[stage].scale,
        unit_stated=False,
        camera_position=np.zeros(3),
        metrics={name: figure for name in kept},
        seconds={name: 1.5 for name in kept},
        notices=(("twist_ambiguous", "Another pose fits almost as well."),),
        stops={},
        facts={"organ": "ellipsoid"},
        twists={"twists_deg": [0.0, 120.0, 240.0], "costs": [3.0, 1.0, 2.0], "cost_name": "cost", "chosen_deg": 120.0},
    )
    if stage != "elastic":
        return replace(base, **changes)
    elastic_part = {
        "surfaces": surfaces | {"elastic": true},
        "distance_mm": base.distance_mm | {"elastic": np.linspace(0, 4, len(true))},
        "displacement_mm": np.linalg.norm(bent.surface_displacement_mm, axis=1),
        "det_f": bent.surface_det_f,
        "volume_ct": bent.volume_points,
        "volume_scene": bent.map_points(bent.volume_points),
        "steps": tuple(_step(k) for k in range(5)),
        "asset": asset_bytes(bent),
        "grids": grids() if sampled else None,
    }
    return replace(base, **(elastic_part | changes))


def splat_node(scene):
    """The registered surface as a splat under its scene-to-world transform, shown at a guessed scale."""
    centres = organ().scene_vertices.astype(np.float32)
    count = len(centres)
    columns = SplatColumns(
        centres=centres,
        colours=np.tile(np.array([[190, 80, 70]], dtype=np.uint8), (count, 1)),
        opacities=np.full(count, 0.9, dtype=np.float32),
        scales=np.full((count, 3), 0.01, dtype=np.float32),
        rotations=np.tile(np.array([[1, 0, 0, 0]], dtype=np.float32), (count, 1)),
        valid=np.ones(count, dtype=bool),
    )
    node = scene.AddNewNodeByClass("vtkMRMLModelNode", "Splat")
    node.SetAndObserveMesh(polydata_of(columns))
    node.SetAttribute("OrganPhys.Splat", "1")
    node.CreateDefaultDisplayNodes()
    set_scale(node, 77.0, "guess")
    return node


def segmentation_node(scene, name: str = "CT segments", inside=None, *, turn=None, step: float = 4.0):
    """A segmentation with one segment "organ": voxels of ``step`` mm where ``inside`` (N, 3) mm -> (N,) bool holds.

    turn (3, 3): rotation of the voxel axes about the organ's centre.
    """
    bent, turn = organ(), np.eye(3) if turn is None else turn
    centre = bent.vertices.mean(0)
    half = np.ceil(np.linalg.norm(bent.vertices - centre, axis=1).max() / step + 1) * step
    count = int(2 * half / step) + 1
    matrix = np.eye(4)
    matrix[:3, :3] = step * turn
    matrix[:3, 3] = centre - turn @ np.full(3, half)
    k, j, i = np.meshgrid(*[np.arange(count)] * 3, indexing="ij")
    places = np.stack([i, j, k], axis=-1).reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]
    holds = bent.outside_distance_mm(places) == 0 if inside is None else inside(places)
    image = slicer.vtkOrientedImageData()
    image.SetDimensions(count, count, count)
    image.SetImageToWorldMatrix(matrix_of(matrix))
    labels = numpy_to_vtk(holds.astype(np.uint8), deep=True, array_type=vtk.VTK_UNSIGNED_CHAR)
    image.GetPointData().SetScalars(labels)
    node = scene.AddNewNodeByClass("vtkMRMLSegmentationNode", name)
    node.CreateDefaultDisplayNodes()
    node.AddSegmentFromBinaryLabelmapRepresentation(image, "organ")
    return node


def world_points(node, points) -> np.ndarray:
    """Points (N, 3) under a transform node, in the world, mm."""
    transform = vtk.vtkGeneralTransform()
    node.GetTransformToWorld(transform)
    return np.array([transform.TransformPoint(point) for point in points])


def true_world_points(case, points_ct) -> np.ndarray:
    """Where the registered organ has CT points (N, 3), mm in the endoscope frame."""
    matrix = np.array(case.record["T_overlay_scene"])
    return organ().map_points(points_ct) @ matrix[:3, :3].T + matrix[:3, 3]


def _step(k: int) -> dict[str, float]:
    return {
        "alpha": 0.05, "trim30_splat_to_ct_mm": 3.0 - 0.4 * k, "mean_ct_to_splat_mm": 4.0, "trim30_ct_to_splat_mm": 3.5,
        "volume_drift_percent": -0.2 * k, "min_det_f": 0.9, "largest_move_mm": 1.0, "energy": 2.0, "evaluations": 3,
    }  # fmt: skip
