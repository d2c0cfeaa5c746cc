"""Writers of registration input: label map, INRIA splat, Slicer markups. Used for sample cases and tests."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..ground.atomic_file import atomic_path, write_text
from ..ground.checks import Array
from ..ground.frames import ras_from_lps
from ..points.gaussians import SH_C0, Gaussians
from .gaussian_ply import write_gaussians


def write_label_map(path: str | Path, labels: NDArray[np.uint8], affine: Array) -> None:
    """A NIfTI or NRRD label map; labels (I, J, K), affine (4, 4) voxel -> RAS mm, oblique or flipped if it likes."""
    import SimpleITK

    image = SimpleITK.GetImageFromArray(np.ascontiguousarray(labels.transpose(2, 1, 0)))
    spacing = np.linalg.norm(affine[:3, :3], axis=0)
    image.SetSpacing(spacing.tolist())
    image.SetOrigin(ras_from_lps(affine[:3, 3]).tolist())
    image.SetDirection((np.diag([-1.0, -1.0, 1.0]) @ affine[:3, :3] / spacing).ravel().tolist())
    with atomic_path(path) as temporary:
        SimpleITK.WriteImage(image, str(temporary), useCompression=True)


def write_splat(
    path: str | Path, centres: Array, deviations: Array, quaternions: Array, colours: Array, opacities: Array
) -> None:
    """An INRIA 3DGS PLY of SH degree 0: logit opacities, log standard deviations, quaternions w x y z, zero normals.

    centres, deviations, colours (N, 3), quaternions (N, 4), opacities (N,); colours and opacities in 0..1.
    """
    count, share = len(centres), np.clip(opacities, 1e-6, 1 - 1e-6)
    gaussians = Gaussians(
        means=np.asarray(centres),
        log_scales=np.log(deviations),
        quaternions=quaternions,
        opacity_logits=np.log(share / (1 - share)),
        sh_dc=(np.asarray(colours) - 0.5) / SH_C0,
        sh_rest=np.zeros((count, 3, 0)),
        valid=np.ones(count, dtype=bool),
    )
    write_gaussians(path, gaussians)


def write_landmarks(path: str | Path, points_ct: Array, names: tuple[str, ...]) -> None:
    """Points (L, 3) RAS mm as a Slicer markups file (.mrk.json), stored in LPS as Slicer does."""
    controls = [
        {"id": str(k + 1), "label": name, "position": ras_from_lps(point).tolist()}
        for k, (point, name) in enumerate(zip(points_ct, names, strict=True))
    ]
    markup = {"type": "Fiducial", "coordinateSystem": "LPS", "coordinateUnits": "mm", "controlPoints": controls}
    write_json(path, {"markups": [markup]})


def write_json(path: str | Path, record: dict[str, object]) -> None:
    """A JSON file, indented, UTF-8."""
    write_text(path, json.dumps(record, indent=1) + "\n")


def write_arrays(path: str | Path, arrays: dict[str, NDArray]) -> None:
    """A compressed .npz file."""
    with atomic_path(path) as temporary, open(temporary, "wb") as file:
        np.savez_compressed(file, **arrays)  # type: ignore[arg-type]
