"""Animations through pillow, which is there anyway: WebP (small, any browser), GIF (256 colours) or PNG (lossless).

An mp4 would need an encoder of some 70 MB (ffmpeg); any video tool turns these files into one.
"""

from __future__ import annotations

import os
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..ground.atomic_file import atomic_path
from ..ground.checks import InputError, as_positive, one_of

FORMATS = ("webp", "gif", "png")


def write_animation(
    path: str | os.PathLike[str], images: Sequence[NDArray[np.uint8]], *, fps: float, format: str = "webp"
) -> None:
    """Images (h, w, 3) of one size as an endless animation, atomically; InputError without any image."""
    from PIL import Image

    one_of(format, "video format", FORMATS)
    if not len(images):
        raise InputError("video: there are no frames; simulate at least one step")
    first, *rest = (Image.fromarray(image) for image in images)
    options = {"quality": 80, "method": 2} if format == "webp" else {}
    with atomic_path(path) as temporary:
        first.save(
            temporary,
            format=format.upper(),
            save_all=True,
            append_images=rest,
            duration=round(1000 / as_positive(fps, "frames per second")),
            loop=0,
            **options,
        )
