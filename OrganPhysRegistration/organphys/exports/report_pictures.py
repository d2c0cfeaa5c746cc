"""The overlay pictures of the report: every stage from the camera, from beside and from above."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..asset.surface_distance import vertex_normals
from ..ground.checks import Array
from .camera_view import View
from .mesh_thinning import ThinMesh, thin_mesh
from .picture_svg import label, scale_bar, svg_picture
from .renderer import SplatLayer, overlay_picture, splat_picture
from .report_content import ReportContent, StagePicture

WIDTH, HEIGHT = 400, 300
VIEW_NAMES = ("from the camera", "from the side", "from above")
ROUND = ("from the camera", "from the side", "from behind")
RAMP = np.array([[0.13, 0.40, 0.67], [0.40, 0.76, 0.65], [1.0, 0.93, 0.55], [0.96, 0.55, 0.26], [0.70, 0.05, 0.15]])
UNKNOWN = np.array([0.42, 0.45, 0.50])


@dataclass(frozen=True)
class PictureRow:
    """name of the row and one SVG for each of ``views``."""

    name: str
    pictures: tuple[str, ...]
    views: tuple[str, ...] = VIEW_NAMES


def overlay_rows(content: ReportContent) -> list[PictureRow]:
    """The splat alone, every stage over it, and the last stage painted by its distance to the splat if known."""
    if not content.stages or not len(content.splat_centres):
        return []
    thin = thin_mesh(content.vertices_ct, content.faces)
    layers = splat_layers(content, thin.averaged(content.stages[-1].vertices))
    rows = [PictureRow("Splat", tuple(_finish(layer, splat_picture(layer), content) for layer in layers))]
    rows += [_stage_row(stage, thin, layers, content) for stage in content.stages]
    last = content.stages[-1]
    if last.distances_mm is not None and np.isfinite(last.distances_mm).any():
        name = f"{last.name}: distance to the splat"
        rows.append(_painted_row(name, last, last.distances_mm, thin, layers, content))
    if content.errors_mm is not None:
        name = f"{last.name}: radius that holds the true position with 95 % probability"
        front = layers[0]
        around = [front, layers[1], replace(front, view=front.view.turned(1, 180).fitted(thin.averaged(last.vertices)))]
        row = _painted_row(name, last, content.errors_mm, thin, around, content)
        rows.append(replace(row, views=ROUND))
    return rows


def splat_layers(content: ReportContent, organ: Array) -> list[SplatLayer]:
    """The splat in the three views that hold the registered ``organ`` (N, 3) and the splat's bulk."""
    centres = content.splat_centres
    shown = np.concatenate([organ, _bulk(centres, organ)])
    front = View(content.camera.position, organ.mean(0), np.array([0.0, 1.0, 0.0]), 1.0, WIDTH, HEIGHT)
    views = (front, front.turned(1, 65), front.turned(0, -65))
    radius = 2.0 * point_spacing(centres)
    return [SplatLayer(view.fitted(shown), centres, content.splat_colours, radius) for view in views]


def _bulk(centres: Array, organ: Array) -> Array:
    """Splat points (M, 3) that the pictures must hold: those near the organ, without stray ones and background."""
    few = centres[:: max(1, len(centres) // 5000)]
    middle = organ.mean(0)
    near = np.linalg.norm(few - middle, axis=1) <= 1.1 * np.linalg.norm(organ - middle, axis=1).max()
    if near.mean() > 0.2:
        return few[near]
    away = np.linalg.norm(few - np.median(few, axis=0), axis=1)  # the organ missed the splat: show both
    return few[away <= np.percentile(away, 97)]


def point_spacing(points: Array) -> float:
    """Median distance to the nearest other point of (N, 3), from up to 2000 of them."""
    if len(points) < 2:
        return 0.0
    return float(np.median(cKDTree(points).query(points[:: max(1, len(points) // 2000)], k=2)[0][:, 1]))


def ramp_colours(values: Array, top: float) -> Array:
    """Colours (N, 3) of values 0 (blue) to ``top`` (red); grey where not finite."""
    place = np.clip(np.nan_to_num(values, nan=0.0, posinf=top) / top, 0, 1) * (len(RAMP) - 1)
    steps = np.arange(len(RAMP))
    colours = np.stack([np.interp(place, steps, RAMP[:, k]) for k in range(3)], axis=1)
    return np.where(np.isfinite(values)[:, None], colours, UNKNOWN)


def _stage_row(stage: StagePicture, thin: ThinMesh, layers: Sequence[SplatLayer], content: ReportContent) -> PictureRow:
    vertices = thin.averaged(stage.vertices)
    normals = vertex_normals(vertices, thin.faces)
    images = [overlay_picture(layer, vertices, thin.faces, normals=normals) for layer in layers]
    return PictureRow(
        stage.name, tuple(_finish(layer, image, content) for layer, image in zip(layers, images, strict=True))
    )


def _painted_row(
    name: str,
    stage: StagePicture,
    values_mm: Array,
    thin: ThinMesh,
    layers: Sequence[SplatLayer],
    content: ReportContent,
) -> PictureRow:
    """The surface of a stage painted by ``values_mm`` (Nv,)."""
    values = np.asarray(values_mm, dtype=np.float64)
    top = float(np.clip(np.ceil(np.nanpercentile(values[np.isfinite(values)], 80)), 2, 10))
    vertices, colours = thin.averaged(stage.vertices), thin.averaged(ramp_colours(values, top))
    normals = vertex_normals(vertices, thin.faces)
    pictures = []
    for layer in layers:
        empty = SplatLayer(layer.view, np.zeros((0, 3)), np.zeros((0, 3)), 1.0)
        image = overlay_picture(empty, vertices, thin.faces, normals=normals, colours=colours)
        pictures.append(svg_picture(_with_bar(image), [*_ramp_words(top), scale_bar(layer.view, content.mm_per_unit)]))
    return PictureRow(name, tuple(pictures))


def _with_bar(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Picture with the colour ramp at the lower left."""
    image = image.copy()
    bar = ramp_colours(np.linspace(0, 1, 110), 1.0)
    image[HEIGHT - 17 : HEIGHT - 9, 12:122] = (255 * bar).astype(np.uint8)
    return image


def _ramp_words(top: float) -> list[str]:
    return [label(12, HEIGHT - 22, "0", size=12), label(122, HEIGHT - 22, f"{top:g} mm", size=12, anchor="end")]


def _finish(layer: SplatLayer, image: NDArray[np.uint8], content: ReportContent) -> str:
    return svg_picture(image, [scale_bar(layer.view, content.mm_per_unit)])
