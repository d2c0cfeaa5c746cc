"""Pictures as inline SVG: the pixels embedded, lines and words drawn over them as vectors."""

from __future__ import annotations

import base64
import io
from html import escape

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import Array
from .camera_view import View


def svg_picture(image: NDArray[np.uint8], overlays: list[str] | None = None, *, title: str = "") -> str:
    """Image (h, w, 3) with SVG elements over it, in pixels of the image."""
    height, width = image.shape[:2]
    return (
        f'<svg viewBox="0 0 {width} {height}" role="img" aria-label="{escape(title, quote=True)}">'
        f'<image width="{width}" height="{height}" href="{_data_address(image)}"/>{"".join(overlays or [])}</svg>'
    )


def label(x: float, y: float, words: str, *, colour: str = "#e8edf4", size: int = 15, anchor: str = "start") -> str:
    """Text at pixel x, y (baseline), over a dark edge."""
    place = f'x="{x:.1f}" y="{y:.1f}" font-size="{size}" text-anchor="{anchor}"'
    shadow = f'<text {place} fill="#14171c" stroke="#14171c" stroke-width="3" stroke-linejoin="round">'
    return "".join(f"{start}{escape(words)}</text>" for start in (shadow, f'<text {place} fill="{colour}">'))


def line(start: Array, end: Array, *, colour: str, width: float = 2.0, dashed: bool = False) -> str:
    """Straight line between two pixel positions."""
    dashes = ' stroke-dasharray="5 4"' if dashed else ""
    return (
        f'<line x1="{start[0]:.1f}" y1="{start[1]:.1f}" x2="{end[0]:.1f}" y2="{end[1]:.1f}" '
        f'stroke="{colour}" stroke-width="{width}" stroke-linecap="round"{dashes}/>'
    )


def arrow(start: Array, end: Array, *, colour: str, width: float = 4.0) -> str:
    """Arrow between two pixel positions; a dot where it points at the reader."""
    along = np.asarray(end[:2] - start[:2], dtype=np.float64)
    length = float(np.linalg.norm(along))
    if length < 2 * width:
        return f'<circle cx="{start[0]:.1f}" cy="{start[1]:.1f}" r="{1.5 * width}" fill="{colour}"/>'
    along /= length
    across = np.array([-along[1], along[0]])
    neck = end[:2] - 4 * width * along
    corners = (end[:2], neck + 2 * width * across, neck - 2 * width * across)
    head = " ".join(f"{p[0]:.1f},{p[1]:.1f}" for p in corners)
    return line(start, neck, colour=colour, width=width) + f'<polygon points="{head}" fill="{colour}"/>'


def scale_bar(view: View, mm_per_unit: float) -> str:
    """Bar of a round number of millimetres, true at the depth of the view's target, at the lower right."""
    pixels_per_mm = view.focal / (view.distance * mm_per_unit)
    longest = 0.28 * view.width / pixels_per_mm
    power = 10.0 ** np.floor(np.log10(longest))
    length = max(step * power for step in (1, 2, 5) if step * power <= longest)
    x, y, extent = view.width - 14, view.height - 12, length * pixels_per_mm
    bar = line(np.array([x - extent, y]), np.array([x, y]), colour="#e8edf4", width=3)
    return bar + label(x, y - 8, f"{length:g} mm", size=13, anchor="end")


def _data_address(image: NDArray[np.uint8]) -> str:
    from PIL import Image  # comes with matplotlib; not needed to import this package

    stream = io.BytesIO()
    Image.fromarray(image).save(stream, format="JPEG", quality=88, subsampling=0)
    return "data:image/jpeg;base64," + base64.b64encode(stream.getvalue()).decode("ascii")
