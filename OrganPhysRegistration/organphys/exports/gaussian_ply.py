"""A full splat as an INRIA 3DGS PLY, which SuperSplat, gsplat and the readers here read; row i stays row i."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..ground.atomic_file import atomic_path
from ..points.gaussians import Gaussians


def write_gaussians(path: str | Path, gaussians: Gaussians) -> None:
    """All Gaussians in order, float32, with normals of 0 if there are none; further fields in their own type."""
    import plyfile

    rest = gaussians.sh_rest.reshape(len(gaussians), -1)  # channel after channel, as INRIA's files have it
    columns = {
        **dict(zip("xyz", gaussians.means.T, strict=True)),
        **{name: gaussians.extra.get(name, np.zeros(len(gaussians))) for name in ("nx", "ny", "nz")},
        **{f"f_dc_{k}": gaussians.sh_dc[:, k] for k in range(3)},
        **{f"f_rest_{k}": rest[:, k] for k in range(rest.shape[1])},
        "opacity": gaussians.opacity_logits,
        **{f"scale_{k}": column for k, column in enumerate(gaussians.log_scales.T)},
        **{f"rot_{k}": column for k, column in enumerate(gaussians.quaternions.T)},
    }
    extra = {name: values for name, values in gaussians.extra.items() if name not in columns}
    types = [(name, "<f4") for name in columns] + [(name, values.dtype.str) for name, values in extra.items()]
    rows = np.empty(len(gaussians), dtype=types)
    for name, values in (columns | extra).items():
        rows[name] = values
    element = plyfile.PlyElement.describe(rows, "vertex")
    with atomic_path(path) as temporary:
        plyfile.PlyData([element], byte_order="<").write(str(temporary))
