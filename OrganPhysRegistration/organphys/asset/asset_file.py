"""The .organphys file: one zip with organ.json and .npy arrays, versioned, without pickle and without dates."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..basis.reduced_basis import ReducedBasis
from ..basis.reduced_covariance import ReducedCovariance
from ..ground.atomic_file import write_bytes
from ..ground.checks import LARGEST, Array, InputError
from ..ground.frames import Normalisation, Similarity
from .array_archive import archive_bytes, check_numbers, read_archive, read_archive_bytes
from .registered_organ import RegisteredOrgan

FORMAT, VERSION, HEADER = "organphys-asset", 2, "organ.json"  # 2: may carry its uncertainty
FRAMES = {
    "ct": "RAS, mm",
    "scene": "raw coordinates of the splat file, OpenCV axes, scene units",
    "normalised": "(ct - centre) / length",
    "covariance": "of (z, gamma) = factor factor^T; scene = T_scene_ct about gamma = 1, scale / gamma",
    "map": "scene = T_scene_ct(undo(X + Phi(X) z)), X normalised; T_scene_ct = scale rotation x + translation",
}
ROTATION_ERROR = 1e-6
LEAST = 1e-9
FACTOR = "uncertainty/factor"
GEOMETRY = ("z", "vertices", "faces", "volume_points", "quadrature_points", "quadrature_weights")


def save_asset(organ: RegisteredOrgan, path: str | os.PathLike[str]) -> None:
    """Write the organ to ``path``, atomically; the same organ gives the same bytes. InputError if not writable."""
    write_bytes(path, asset_bytes(organ))


def asset_bytes(organ: RegisteredOrgan) -> bytes:
    """The content of the .organphys file."""
    arrays = {name: getattr(organ, name) for name in GEOMETRY}
    arrays["faces"] = organ.faces.astype(np.int32)
    arrays |= {f"basis/{name}": value for name, value in organ.basis.arrays().items()}
    if organ.uncertainty is not None:
        arrays[FACTOR] = organ.uncertainty.factor
    return archive_bytes(HEADER, _header(organ), arrays)


def load_asset(path: str | os.PathLike[str]) -> RegisteredOrgan:
    """The organ written by ``save_asset``; it maps points bit for bit as the saved one.

    InputError for a file that is missing, damaged, not an asset, or written by a newer version.
    """
    return _checked_organ(*read_archive(path, HEADER), str(path))


def asset_from_bytes(content: bytes, *, name: str = "asset") -> RegisteredOrgan:
    """The organ of ``asset_bytes``, checked as a file is; ``name``: what errors call it."""
    return _checked_organ(*read_archive_bytes(content, name, HEADER), name)


def _checked_organ(header: Mapping[str, Any], arrays: Mapping[str, np.ndarray], path: str) -> RegisteredOrgan:
    if header.get("format") != FORMAT or not isinstance(header.get("version"), int):
        raise InputError(f"{path}: is no OrganPhys asset; name an .organphys file")
    if header["version"] > VERSION:
        raise InputError(f"{path}: asset version {header['version']} is newer than {VERSION}; update organphys")
    try:
        check_numbers(arrays, "arrays")
        organ = _organ(header, arrays)
        _check_map(organ)
        return organ
    except (KeyError, TypeError, ValueError, IndexError, AttributeError, OverflowError) as error:
        text = f"{path}: damaged (organ.json or arrays: {str(error)[:200]}); write or copy it again"
        raise InputError(text) from error


def _check_map(organ: RegisteredOrgan) -> None:
    """InputError where the parts of the map do not fit together, told by mapping a point."""
    unit = 1.0 if organ.mm_per_scene_unit is None else organ.mm_per_scene_unit
    sizes = (organ.normalisation.length, organ.T_scene_ct.scale, organ.volume_ml, unit)
    if not all(LEAST < size < 1 / LEAST for size in sizes):
        raise InputError("a length, scale, unit or volume that no organ has")
    check_similarities(organ.T_scene_ct.rotation[None], organ.T_scene_ct.translation, organ.normalisation.centre)
    radii = organ.basis.weights.arrays().get("radii")
    if radii is not None and not (radii > LEAST).all():
        raise InputError("kernels without extent")
    with np.errstate(all="ignore"):
        phi = organ.basis.phi(organ.normalisation.apply(organ.vertices[:1]))
        if phi.shape != (1, organ.basis.size) or not (np.abs(phi @ organ.z) <= LARGEST).all():
            raise InputError("a map without finite places")


def check_similarities(rotations: Array, *shifts: Array) -> None:
    """InputError unless rotations (N, 3, 3) are proper and shifts finite."""
    if not all((np.abs(part) <= LARGEST).all() for part in (rotations, *shifts)):
        raise InputError("a rotation or translation that is not finite")
    error = np.abs(rotations @ rotations.transpose(0, 2, 1) - np.eye(3)).max()
    if not error <= ROTATION_ERROR or not (np.linalg.det(rotations) > 0).all():
        raise InputError("a rotation that is none")


def _header(organ: RegisteredOrgan) -> dict[str, Any]:
    similarity, normalisation = organ.T_scene_ct, organ.normalisation
    return {
        "format": FORMAT,
        "version": VERSION,
        "frames": FRAMES,
        "name": organ.name,
        "volume_ml": organ.volume_ml,
        "mm_per_scene_unit": organ.mm_per_scene_unit,
        "T_scene_ct": {
            "scale": similarity.scale,
            "rotation": similarity.rotation,
            "translation": similarity.translation,
        },
        "normalisation": {"centre": normalisation.centre, "length": normalisation.length},
        "basis": {"weights": organ.basis.weights.kind},
        "tissue": organ.tissue,
        "provenance": organ.provenance,
        "uncertainty": None if organ.uncertainty is None else _freedom_out(organ.uncertainty.freedom),
    }


def _freedom_out(freedom: float) -> dict[str, float | None]:
    """Degrees of freedom of the Student t; null for a Gaussian, for JSON knows no infinity."""
    return {"degrees_of_freedom": freedom if np.isfinite(freedom) else None}


def _uncertainty(header: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> ReducedCovariance | None:
    """None in files of version 1 and of methods that give none."""
    entry = header.get("uncertainty")
    if entry is None:
        return None
    freedom = entry["degrees_of_freedom"]
    return ReducedCovariance(arrays[FACTOR], np.inf if freedom is None else float(freedom))


def _organ(header: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> RegisteredOrgan:
    similarity, normalisation = header["T_scene_ct"], header["normalisation"]
    basis = {name.removeprefix("basis/"): value for name, value in arrays.items() if name.startswith("basis/")}
    unit = header["mm_per_scene_unit"]
    return RegisteredOrgan(
        T_scene_ct=Similarity(similarity["scale"], similarity["rotation"], similarity["translation"]),
        normalisation=Normalisation(
            np.array(normalisation["centre"], dtype=np.float64).reshape(3), float(normalisation["length"])
        ),
        basis=ReducedBasis.from_arrays(header["basis"]["weights"], basis),
        **{name: arrays[name] for name in GEOMETRY},
        volume_ml=float(header["volume_ml"]),
        name=str(header["name"]),
        tissue=dict(header["tissue"]),
        mm_per_scene_unit=None if unit is None else float(unit),
        provenance=dict(header["provenance"]),
        uncertainty=_uncertainty(header, arrays),
    )
