"""A sheet of captioned pictures as one PNG."""

from __future__ import annotations

import os
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..ground.atomic_file import atomic_path

Picture = tuple[str, NDArray[np.uint8]]


def write_picture_sheet(path: str | os.PathLike[str], rows: Sequence[Sequence[Picture]], *, dpi: int = 100) -> None:
    """Rows of (caption, (h, w, 3) image), all of one size, side by side; written atomically."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    across = max(map(len, rows))
    height, width = rows[0][0][1].shape[:2]
    caption = 26
    figure = Figure(figsize=(across * width / dpi, len(rows) * (height + caption) / dpi), dpi=dpi, facecolor="white")
    FigureCanvasAgg(figure)
    total = len(rows) * (height + caption)
    for down, row in enumerate(rows):
        for along, (text, image) in enumerate(row):
            bottom = total - (down + 1) * (height + caption)
            axes = figure.add_axes((along / across, bottom / total, 1 / across, height / total))
            axes.imshow(image, interpolation="none", aspect="auto")
            axes.set_axis_off()
            figure.text((along + 0.5) / across, (bottom + height + 8) / total, text, ha="center", fontsize=11)
    with atomic_path(path) as temporary:
        figure.savefig(temporary, format="png", metadata={"Software": None})
