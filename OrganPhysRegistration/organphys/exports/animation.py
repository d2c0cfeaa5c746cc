"""Animations through pillow, which is there anyway: WebP (small, any browser), GIF (256 colours) or PNG (lossless);
and mp4 where the program ffmpeg is installed, an encoder of some 70 MB that is not brought along.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..ground.atomic_file import atomic_path
from ..ground.checks import InputError, as_positive, one_of

FORMATS = ("webp", "gif", "png", "mp4")


def write_animation(
    path: str | os.PathLike[str], images: Sequence[NDArray[np.uint8]], *, fps: float, format: str = "webp"
) -> None:
    """Images (h, w, 3) of one size as an endless animation, atomically; InputError without any image, or for mp4
    without ffmpeg."""
    from PIL import Image

    one_of(format, "video format", FORMATS)
    if not len(images):
        raise InputError("video: there are no frames; simulate at least one step")
    if format == "mp4":
        _write_mp4(path, images, as_positive(fps, "frames per second"))
        return
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


def ffmpeg() -> str:
    """The path of the ffmpeg program; InputError if there is none."""
    found = shutil.which("ffmpeg")
    if found is None:
        raise InputError("mp4: the program ffmpeg is not on the PATH; install it, or take webp, gif or png")
    return found


def _write_mp4(path: str | os.PathLike[str], images: Sequence[NDArray[np.uint8]], fps: float) -> None:
    """H.264 in the pixel format that all players know, which needs even sides: an odd one loses its last row."""
    height, width = (side - side % 2 for side in images[0].shape[:2])
    read = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", f"{fps:g}", "-i", "-"]
    write = ["-an", "-c:v", "libx264", "-pix_fmt", "yuv420p", "-movflags", "+faststart", "-f", "mp4"]
    frames = b"".join(np.ascontiguousarray(image[:height, :width]).tobytes() for image in images)
    with atomic_path(path) as temporary:
        command = [ffmpeg(), "-y", "-loglevel", "error", *read, *write, str(temporary)]
        done = subprocess.run(command, input=frames, capture_output=True, check=False)
        if done.returncode:
            words = done.stderr.decode(errors="replace").strip().splitlines()
            raise InputError(f"mp4: ffmpeg failed ({words[-1] if words else done.returncode}); take webp, gif or png")
