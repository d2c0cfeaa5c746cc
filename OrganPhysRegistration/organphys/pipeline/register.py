"""One registration from point sets to a registered organ with its metrics and warnings."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from time import perf_counter
from typing import Any

import numpy as np
from scipy.spatial import cKDTree
from threadpoolctl import threadpool_limits

from ..align.metrics import strain_percentiles, surface_distances, volume_drift_percent
from ..asset.registered_organ import VOLUME_POINTS, RegisteredOrgan
from ..elastic.records import ElasticResult
from ..ground.checks import Array, InputError
from ..ground.frames import Similarity
from ..ground.progress import Progress, no_progress
from ..mechanics.tissue import tissue_for
from ..points.neighbours import nearest_neighbours
from ..points.point_sets import Box, Camera, GaussianCloud, Landmarks, Organ, SceneUnit
from ..points.sampling import random_subset
from .default_method import run_default
from .landmark_checks import checked_landmarks
from .paper_method import run_paper
from .registration import MethodResult, RegisterOptions, Registration
from .result_notices import SurfaceState, result_notices
from .scene import Scene, select_scene

FEWEST_VOXELS = 60  # the basis needs a few more nodes than its handles
SAMPLE = 15_000  # vertices whose distance to the splat is taken after the coarse and the rigid stage

# The matrices are small and the stages bring their own two threads: BLAS threads beside them cost tenfold time.
one_blas_thread = threadpool_limits.wrap(limits=1, user_api="blas")


@one_blas_thread
def register(
    organ: Organ,
    splat: GaussianCloud,
    options: RegisterOptions | None = None,
    *,
    landmarks: Landmarks | None = None,
    camera: Camera | None = None,
    box: Box | None = None,
    unit: SceneUnit | None = None,
    provenance: Mapping[str, Any] | None = None,
    progress: Progress = no_progress,
) -> Registration:
    """Register ``organ`` (RAS mm) onto ``splat`` (raw scene units).

    ``box``: crop of the splat; ``unit``: millimetres per scene unit if known; ``provenance``: facts of the inputs that
    go into the asset. Same seed, same result. InputError tells what is wrong with the input; nothing is written.
    """
    began = perf_counter()
    options, camera = options or RegisterOptions(), camera or Camera()
    _check_size(organ)
    positions, landmark_notices = checked_landmarks(landmarks, organ)
    scene = select_scene(splat, box, options, progress)
    run = run_default if options.method == "organphys" else run_paper
    found = run(organ, scene, positions, camera, unit, options, progress)
    exact = unit.mm_per_unit if unit is not None and unit.percent == 0 else None
    registered = _registered_organ(organ, found.elastic, exact, dict(provenance or {}))
    similarities = {"before": _before(organ, scene, found), **found.similarities, "elastic": registered.T_scene_ct}
    tree = cKDTree(scene.target)
    to_splat = nearest_neighbours(tree, registered.scene_vertices)[0]
    # the quadrature points lie inside, so the field beside the organ need not be baked
    gradients = registered.deformation.inside(registered.quadrature_points)[1] + np.eye(3)
    metrics = _metrics(registered, similarities, tree, to_splat, gradients)
    state = _surface_state(organ, registered, to_splat * registered.mm_per_unit, gradients)
    notices = result_notices(
        state, camera.position, name=organ.name, volume_ml=organ.volume_ml, mm_per_unit=registered.mm_per_unit
    )
    return Registration(
        organ=registered,
        options=options,
        similarities=similarities,
        coarse_view=found.coarse_view,
        steps=found.elastic.steps,
        metrics=metrics,
        stops=found.stops,
        seconds=found.seconds,
        notices=(*organ.notices, *splat.notices, *landmark_notices, *scene.notices, *found.notices, *notices),
        target=scene.target,
        vertex_distance_mm=state.distance_mm,
        vertex_seen=state.seen(camera.position),
        splat_points=splat.centres[scene.picture],
        splat_colours=splat.colours[scene.picture],
        camera=camera,
        unit=unit,
        facts={
            "organ": f"{organ.name}, {organ.volume_ml:.1f} ml",
            "splat": f"{len(splat)} Gaussians, {len(scene.centres)} opaque ones used",
            "landmarks": str(len(positions)),
            "unit": "not stated" if unit is None else f"{unit.mm_per_unit:g} mm per scene unit, +- {unit.percent:g} %",
        },
        began=began,
    )


def peak_memory_mb() -> float | None:
    """Largest resident memory of this process so far, MB; None where the system does not tell (Windows)."""
    try:
        import resource
    except ImportError:
        return None
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / (2**20 if sys.platform == "darwin" else 2**10)


def _check_size(organ: Organ) -> None:
    if len(organ.volume_points) < FEWEST_VOXELS:
        raise InputError(
            f"organ: {organ.name} has only {len(organ.volume_points)} voxels ({organ.volume_ml:.3g} ml), at least "
            f"{FEWEST_VOXELS} are needed; use a finer label map or check the label"
        )


def _before(organ: Organ, scene: Scene, found: MethodResult) -> Similarity:
    """The CT as it lies in its own axes, put on the splat's centroid at the coarse scale: the picture "before"."""
    scale = found.similarities["coarse"].scale
    return Similarity(scale, np.eye(3), scene.target.mean(0) - scale * organ.vertices.mean(0))


def _registered_organ(
    organ: Organ, elastic: ElasticResult, mm_per_unit: float | None, provenance: dict[str, Any]
) -> RegisteredOrgan:
    quadrature = elastic.normalisation.undo(elastic.quadrature_points)
    tissue = tissue_for(organ.name)
    return RegisteredOrgan(
        T_scene_ct=elastic.T_scene_ct,
        normalisation=elastic.normalisation,
        basis=elastic.basis,
        z=elastic.z,
        vertices=organ.vertices,
        faces=organ.faces,
        volume_points=organ.volume_points[random_subset(len(organ.volume_points), VOLUME_POINTS, 0)],
        quadrature_points=quadrature,
        quadrature_weights=np.full(len(quadrature), 1 / len(quadrature)),
        volume_ml=organ.volume_ml,
        name=organ.name,
        tissue=vars(tissue),
        mm_per_scene_unit=mm_per_unit,
        provenance=provenance,
    )


def _metrics(
    registered: RegisteredOrgan,
    similarities: Mapping[str, Similarity],
    tree: cKDTree,
    to_splat: Array,
    gradients: Array,
) -> dict[str, dict[str, dict[str, float | str]]]:
    """Distances of every stage between the organ's surface vertices and the target, volume and strain of the last.

    ``tree``: over the target; ``to_splat`` (Nv,): distances of the final vertices to it, scene units; ``gradients``
    (Q, 3, 3): deformation gradients at the quadrature points.
    """
    vertices = registered.vertices
    box = float(np.abs(vertices - vertices.mean(0)).max())
    sample = random_subset(len(vertices), SAMPLE, 0)  # searches far from the target are slow
    metrics: dict[str, dict[str, dict[str, float | str]]] = {}
    for stage in ("coarse", "rigid", "elastic"):
        scale = similarities[stage].scale
        final = stage == "elastic"
        mapped = registered.scene_vertices if final else similarities[stage].apply(vertices)
        distances = surface_distances(
            mapped,
            tree.data,
            mm_per_unit=registered.mm_per_scene_unit or 1 / scale,
            box_mm=box,
            target_tree=tree,
            to_splat=to_splat if final else nearest_neighbours(tree, mapped[sample])[0],
        )
        metrics[stage] = {**distances.as_metrics(), "scale": {"value": scale, "unit": "scene units per mm"}}
    stretches = strain_percentiles(gradients, (5, 95))
    metrics["elastic"] |= {
        "volume_drift": {"value": volume_drift_percent(gradients), "unit": "%"},
        "min_det_F": {"value": float(np.linalg.det(gradients).min()), "unit": "1"},
        "largest_stretch_p95": {"value": float(stretches["largest_stretch"][1]), "unit": "1"},
        "smallest_stretch_p5": {"value": float(stretches["smallest_stretch"][0]), "unit": "1"},
    }
    return metrics


def _surface_state(organ: Organ, registered: RegisteredOrgan, distance_mm: Array, gradients: Array) -> SurfaceState:
    return SurfaceState(
        points=registered.scene_vertices,
        normals=registered.T_scene_ct.turn(organ.vertex_normals),
        displacement_mm=np.linalg.norm(registered.surface_displacement_mm, axis=1),
        distance_mm=distance_mm,
        radius_mm=float(np.sqrt(((organ.vertices - organ.vertices.mean(0)) ** 2).sum(1).mean())),
        det_f=np.linalg.det(gradients),
    )
