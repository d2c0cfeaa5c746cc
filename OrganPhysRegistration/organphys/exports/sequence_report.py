"""report.html of a sequence: curves over the frames and a strip of pictures."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..asset.organ_sequence import OrganSequence
from ..asset.surface_distance import vertex_normals
from ..ground.atomic_file import write_text
from ..ground.checks import Array
from .camera_view import View
from .mesh_thinning import thin_mesh
from .picture_svg import svg_picture
from .plots import AMBER, BLUE, CRIMSON, _figure, _svg
from .renderer import SplatLayer, overlay_picture
from .report_page import grid, heading, listing, page, paragraph, table, tiles
from .report_pictures import HEIGHT, WIDTH, point_spacing

CURVES = {
    "splat_to_organ_trim30_mm": "splat to organ,\nclosest 70 %, mm",
    "seen_percent": "organ surface\nseen, %",
    "seconds": "time per frame, s",
}


@dataclass(frozen=True)
class SeenFrame:
    """What the splat of a frame looked like: centres (N, 3) scene units, colours (N, 3) in 0..1."""

    frame: int
    centres: Array
    colours: Array


def write_sequence_report(
    path: str | os.PathLike[str],
    sequence: OrganSequence,
    seen: Sequence[SeenFrame],
    camera_position: Array,
    provenance: Mapping[str, Any],
) -> None:
    """Write the report to ``path``, atomically."""
    count, lost = len(sequence), sequence.status.count("lost")
    distance, seconds = sequence.figures["splat_to_organ_trim30_mm"], sequence.figures["seconds"]
    title = f"{sequence.organ.name} followed through {count} splats"
    told = [f"Frame {frame}: {message}." for frame, message in sequence.notices]
    body = [
        heading(title, level=1),
        tiles(
            [
                ("splat to organ, nearest 70 %, median frame", f"{np.median(distance):.2f} mm"),
                ("frames lost", f"{lost} of {count}"),
                ("frames found again by a full search", str(sequence.status.count("restarted"))),
                ("time per further frame, median", f"{np.median(seconds[1:]):.2f} s" if count > 1 else "–"),
            ]
        ),
        *(paragraph(line) for line in told),
        heading("Frames"),
        curves(sequence),
        heading("Overlay"),
        paragraph("The splat of the frame in its own colours; the followed organ as a blue glaze.", soft=True),
        grid(overlays(sequence, seen, camera_position)),
        heading("Every frame"),
        table(("frame", f"time, {sequence.time_unit}", "status", *_columns(sequence)), _rows(sequence)),
        heading("Provenance"),
        listing(provenance),
    ]
    write_text(path, page(title, body))


def curves(sequence: OrganSequence) -> str:
    """The figures over the frames as SVG; frames in which the organ was lost are marked."""
    names = [name for name in CURVES if name in sequence.figures]
    figure, plots = _figure(9.4, 1.9 * len(names), rows=len(names))
    for axes, name in zip(plots, names, strict=True):
        values, first = sequence.figures[name], 1 if name == "seconds" else 0  # a full registration would hide the rest
        axes.plot(np.arange(first, len(values)), values[first:], color=BLUE, marker=".")
        for status, colour in (("lost", CRIMSON), ("restarted", AMBER)):
            at = [k for k, one in enumerate(sequence.status) if one == status]
            if at:
                axes.plot(at, values[at], "o", color=colour, label=status)
                axes.legend(loc="upper right", frameon=False)
        axes.set_xlim(-0.5, len(values) - 0.5)
        axes.xaxis.get_major_locator().set_params(integer=True)
        if name == "seconds":
            axes.set_ylim(bottom=0)
        axes.set_ylabel(CURVES[name])
    plots[-1].set_xlabel("frame (time: without the first, which is a full registration)")
    return _svg(figure)


def overlays(sequence: OrganSequence, seen: Sequence[SeenFrame], camera_position: Array) -> list[tuple[str, str]]:
    """Caption and picture of some frames, all from one view that holds them."""
    if not seen:
        return []
    thin = thin_mesh(sequence.organ.vertices, sequence.organ.faces)
    places = [thin.averaged(sequence.scene_vertices(one.frame)) for one in seen]
    everything = np.concatenate(places)
    view = View(camera_position, everything.mean(0), np.array([0.0, 1.0, 0.0]), 1.0, WIDTH, HEIGHT).fitted(everything)
    pictures = []
    for one, vertices in zip(seen, places, strict=True):
        layer = SplatLayer(view, one.centres, one.colours, 2.0 * point_spacing(one.centres))
        image: NDArray[np.uint8] = overlay_picture(
            layer, vertices, thin.faces, normals=vertex_normals(vertices, thin.faces)
        )
        caption = f"frame {one.frame}, {sequence.times[one.frame]:g} {sequence.time_unit}"
        pictures.append((f"{caption}, {sequence.status[one.frame]}", svg_picture(image, title=caption)))
    return pictures


def _columns(sequence: OrganSequence) -> list[str]:
    units = {"mm": "mm", "percent": "%"}
    found = []
    for name in sequence.figures:
        stem, _, last = name.rpartition("_")
        found.append(f"{stem.replace('_', ' ')}, {units[last]}" if last in units else name)
    return [name if name != "seconds" else "seconds, s" for name in found]


def _rows(sequence: OrganSequence) -> list[tuple[Any, ...]]:
    figures = list(sequence.figures.values())
    return [
        (k, f"{sequence.times[k]:g}", sequence.status[k], *(float(values[k]) for values in figures))
        for k in range(len(sequence))
    ]
