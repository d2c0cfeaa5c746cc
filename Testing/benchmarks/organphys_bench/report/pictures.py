"""Pictures of one case: every method's organ on the splat, painted by its error."""

from __future__ import annotations

import base64
import io
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from organphys.asset.surface_distance import vertex_normals
from organphys.exports.camera_view import View
from organphys.exports.renderer import SplatLayer, overlay_picture, splat_picture
from organphys.ground.checks import Array
from organphys.readers.gaussian_ply import read_splat

from ..peers.methods import METHODS
from .run_set import RunSet

WIDTH, HEIGHT, SHOWN = 300, 225, 20_000
RAMP = np.array([[0.13, 0.40, 0.67], [0.40, 0.76, 0.65], [1.0, 0.93, 0.55], [0.96, 0.55, 0.26], [0.70, 0.05, 0.15]])
RAMP_END = 3.0
"""The last colour of the ramp: this many times the mean TRE of the best similarity."""


def case_pictures(runs: RunSet, case: str, folder: Path) -> list[tuple[str, NDArray[np.uint8]]]:
    """Caption and picture (h, w, 3) from the camera and from the side: the splat, then every method."""
    done = {
        method: runs.baseline[case, method]
        for method in runs.methods
        if (case, method) in runs.baseline and not runs.baseline[case, method]["failure"]
    }
    if not done:
        return []
    layers, limit = splat_layers(folder, done), RAMP_END * runs.oracle_mm(case)
    pictures = [("splat", _side_by_side([splat_picture(layer) for layer in layers]))]
    for method, run in done.items():
        picture = run["picture"]
        vertices, faces = np.array(picture["vertices_scene"]), np.array(picture["faces"])
        colours, normals = ramp(np.array(picture["error_mm"]) / limit), vertex_normals(vertices, faces)
        views = [overlay_picture(layer, vertices, faces, normals=normals, colours=colours) for layer in layers]
        caption = f"{METHODS[method].title}: TRE {run['figures']['tre_mm']['all']['mean']:.2f} mm"
        pictures.append((caption, _side_by_side(views)))
    return pictures


def splat_layers(folder: Path, done: dict) -> list[SplatLayer]:
    """A sample of the opaque splat from the camera and from the side; the views hold OrganPhys's organ or the first."""
    splat = read_splat(folder / "splat.ply")
    opaque = np.flatnonzero(splat.valid & (splat.opacities > 0.1))
    opaque = opaque[:: max(1, len(opaque) // SHOWN)]
    centres, colours = np.asarray(splat.centres[opaque], float), np.asarray(splat.colours[opaque], float)
    organ = np.array((done.get("organphys") or next(iter(done.values())))["picture"]["vertices_scene"])
    front = View(np.zeros(3), organ.mean(0), np.array([0.0, 1.0, 0.0]), 1.0, WIDTH, HEIGHT)
    radius = 0.012 * float(np.linalg.norm(np.ptp(organ, axis=0)))
    return [SplatLayer(view.fitted(organ), centres, colours, radius) for view in (front, front.turned(1, 75))]


def ramp(share: Array) -> Array:
    """Colours (N, 3) of numbers (N,) from 0 to 1: blue, green, yellow, orange, red."""
    at = np.linspace(0, 1, len(RAMP))
    return np.stack([np.interp(np.clip(share, 0, 1), at, RAMP[:, k]) for k in range(3)], axis=1)


def png(picture: NDArray[np.uint8]) -> str:
    """The picture as a data address for HTML."""
    file = io.BytesIO()
    Image.fromarray(picture).save(file, format="PNG", optimize=True)
    return "data:image/png;base64," + base64.b64encode(file.getvalue()).decode("ascii")


def _side_by_side(pictures: list[NDArray[np.uint8]]) -> NDArray[np.uint8]:
    return np.concatenate(pictures, axis=1)
