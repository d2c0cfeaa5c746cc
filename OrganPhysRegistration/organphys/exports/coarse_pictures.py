"""The coarse stage drawn as in the paper's Figures 4 and 5: directions, hull diameter and box extent."""

from __future__ import annotations

import numpy as np

from ..asset.surface_distance import vertex_normals
from ..ground.checks import Array
from .camera_view import View, parallel_view
from .mesh_thinning import thin_mesh
from .picture_svg import arrow, label, line, svg_picture
from .renderer import SplatLayer, solid_picture, splat_picture
from .report_content import CoarseFigures, ReportContent
from .report_pictures import point_spacing

WIDTH, HEIGHT = 440, 320
INDIGO = np.array([0.42, 0.47, 0.95])
BLUE, TEAL, AMBER = "#8fb4ff", "#3fd0c4", "#ffb347"


def coarse_pictures(content: ReportContent, coarse: CoarseFigures) -> list[tuple[str, str]]:
    """Caption and SVG of four pictures: front arrow, viewer arrow, hull diameter, box extent."""
    return [
        ("Front of the CT organ: from its centroid to the visible side", _front(content, coarse)),
        ("Direction from the splat to the endoscope", _viewer(content, coarse)),
        ("Silhouette of the CT organ along its front, with the largest diameter", _hull(content, coarse)),
        ("Splat in its oriented box, with the longest edge", _box(content, coarse)),
    ]


def _front(content: ReportContent, coarse: CoarseFigures) -> str:
    down = np.array([0.0, 0.0, -1.0])
    view = parallel_view(content.vertices_ct, _beside(coarse.front_ct, down), down, WIDTH, HEIGHT)
    centre = content.vertices_ct.mean(0)
    return svg_picture(
        _organ(content, view), _pointing(view, content.vertices_ct, centre, coarse.front_ct, BLUE, "front")
    )


def _viewer(content: ReportContent, coarse: CoarseFigures) -> str:
    down = np.array([0.0, 1.0, 0.0])
    view = parallel_view(content.splat_centres, _beside(coarse.viewer_scene, down), down, WIDTH, HEIGHT)
    centre = content.splat_centres.mean(0)
    overlays = _pointing(view, content.splat_centres, centre, coarse.viewer_scene, TEAL, "to the endoscope")
    return svg_picture(_splat(content, view), overlays)


def _hull(content: ReportContent, coarse: CoarseFigures) -> str:
    view = parallel_view(content.vertices_ct, coarse.front_ct, np.array([0.0, 0.0, -1.0]), WIDTH, HEIGHT)
    a, b = view.project(coarse.hull_segment_ct)
    words = label(14, HEIGHT - 14, f"d = {coarse.hull_diameter_mm:.1f} mm", colour=BLUE)
    return svg_picture(_organ(content, view), [_measure(a, b, BLUE), words])


def _box(content: ReportContent, coarse: CoarseFigures) -> str:
    corners = coarse.box_corners_scene
    towards = content.camera.position - corners.mean(0)
    view = parallel_view(
        corners,
        towards + 0.35 * np.linalg.norm(towards) * np.array([0.6, -1.0, 0.0]),
        np.array([0.0, 1.0, 0.0]),
        WIDTH,
        HEIGHT,
    )
    flat, edges = view.project(corners), box_edges(corners)
    longest = max(edges, key=lambda e: np.linalg.norm(corners[e[0]] - corners[e[1]]))
    overlays = [line(flat[i], flat[j], colour=AMBER, width=1.2, dashed=True) for i, j in edges]
    extent = coarse.box_extent_scene
    words = f"extent = {extent:.3g} units ({extent * content.mm_per_unit:.1f} mm as registered)"
    overlays += [_measure(flat[longest[0]], flat[longest[1]], AMBER)]
    overlays += [label(14, HEIGHT - 14, words, colour=AMBER)]
    return svg_picture(_splat(content, view), overlays)


def box_edges(corners: Array) -> list[tuple[int, int]]:
    """The 12 edges of a box given by its corners (8, 3) in any order: the differences that occur four times."""
    pairs = [(i, j) for i in range(8) for j in range(i + 1, 8)]
    differences = np.array([corners[j] - corners[i] for i, j in pairs])
    size = np.linalg.norm(np.ptp(corners, axis=0))
    same = np.minimum(
        np.linalg.norm(differences[:, None] - differences[None], axis=-1),
        np.linalg.norm(differences[:, None] + differences[None], axis=-1),
    )
    return [pair for pair, count in zip(pairs, (same < 1e-6 * size).sum(1), strict=True) if count == 4]


def _beside(direction: Array, down: Array) -> Array:
    """A direction to look from that shows ``direction`` mostly from the side."""
    side = np.cross(direction, down)
    if np.linalg.norm(side) < 0.1:
        side = np.cross(direction, np.eye(3)[np.argmin(np.abs(direction))])
    return side / np.linalg.norm(side) + 0.35 * direction


def _pointing(view: View, points: Array, centre: Array, direction: Array, colour: str, words: str) -> list[str]:
    """Arrow from the centre of the points along ``direction``, out of them, with its name at the lower left."""
    size = np.percentile(np.linalg.norm(points - centre, axis=1), 99.5)
    reach = max(1.2 * np.percentile((points - centre) @ direction, 99.5), 0.6 * size)
    start, end = view.project(np.stack([centre, centre + reach * direction]))
    return [arrow(start, end, colour=colour), label(14, HEIGHT - 14, words, colour=colour)]


def _measure(a: Array, b: Array, colour: str) -> str:
    return line(a, b, colour=colour, width=2.5) + "".join(
        f'<circle cx="{p[0]:.1f}" cy="{p[1]:.1f}" r="4.5" fill="{colour}"/>' for p in (a, b)
    )


def _organ(content: ReportContent, view: View) -> np.ndarray:
    thin = thin_mesh(content.vertices_ct, content.faces)
    vertices = thin.averaged(content.vertices_ct)
    return solid_picture(view, vertices, thin.faces, normals=vertex_normals(vertices, thin.faces), colour=INDIGO)


def _splat(content: ReportContent, view: View) -> np.ndarray:
    centres = content.splat_centres
    return splat_picture(SplatLayer(view, centres, content.splat_colours, 2.0 * point_spacing(centres)))
