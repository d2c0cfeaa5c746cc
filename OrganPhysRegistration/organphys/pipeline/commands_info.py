"""organphys info: what is in a label map, a splat or an asset."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..ground.checks import InputError


def run(arguments: argparse.Namespace) -> None:
    """The command with its parsed options; InputError for a file that is none of the three."""
    path = Path(arguments.file)
    if path.is_dir():
        raise InputError(f"{path}: this is a folder; name a file in it")
    if not path.is_file():
        raise InputError(f"{path}: no such file")
    with path.open("rb") as file:
        start = file.read(4)
    if start[:2] == b"PK":
        lines = _asset(path)
    elif start[:3] == b"ply" or path.suffix.lower() == ".ply":
        lines = _splat(path)
    else:
        lines = _label_map(path, arguments.label_scheme)
    print("\n".join(lines))


def _asset(path: Path) -> list[str]:
    from ..asset.asset_file import load_asset

    organ = load_asset(path)
    low, high = organ.vertices.min(0), organ.vertices.max(0)
    scale = organ.T_scene_ct.scale
    unit = "not stated" if organ.mm_per_scene_unit is None else f"{organ.mm_per_scene_unit:g} as stated"
    lines = [
        f"{path}: registered organ {organ.name!r}, {organ.volume_ml:.1f} ml",
        f"scale          {scale:.6g} scene units per mm ({1 / scale:.4g} mm per unit)",
        f"mm per unit    {unit}",
        f"surface        {len(organ.vertices)} vertices, {len(organ.faces)} triangles",
        f"CT bounds      {_row(low)} to {_row(high)} RAS mm",
        f"basis          {organ.basis.weights.kind}, {organ.basis.weights.handles} handles",
    ]
    lines += [f"tissue         {name}: {value}" for name, value in organ.tissue.items()]
    return lines + [f"{name:14s} {value}" for name, value in _flat(organ.provenance).items()]


def _splat(path: Path) -> list[str]:
    from ..readers.gaussian_ply import describe_splat

    info = describe_splat(path)
    return [
        f"{path}: splat, {info.kind}, {info.format}",
        f"Gaussians      {info.count}, {info.opaque} with opacity above 0.1, {info.non_finite} not finite",
        f"SH degree      {info.sh_degree}",
        f"bounds         {_row(info.bounds[0])} to {_row(info.bounds[1])} scene units",
        f"properties     {' '.join(info.properties)}",
        *(f"comment        {comment}" for comment in info.comments),
    ]


def _label_map(path: Path, label_scheme: str | None) -> list[str]:
    from ..readers.segmentation_file import describe_segmentation

    info = describe_segmentation(path, label_scheme=label_scheme)
    layers = f", {info.layers} layers" if info.layers > 1 else ""
    lines = [
        f"{path}: label map, {info.pixel_type}{layers}",
        f"voxels         {' x '.join(map(str, info.shape))}",
        f"spacing        {' x '.join(f'{value:g}' for value in info.spacing_mm)} mm",
    ]
    if not info.labels:
        return [*lines, "labels         none: every voxel is 0"]
    return lines + [f"label {label}" for label in info.labels]


def _row(values: object) -> str:
    return "(" + ", ".join(f"{value:.4g}" for value in values) + ")"  # type: ignore[attr-defined]


def _flat(record: object, prefix: str = "") -> dict[str, object]:
    """{"options.seed": 0, ...} of nested mappings."""
    if not hasattr(record, "items"):
        return {prefix: record}
    flat: dict[str, object] = {}
    for name, value in record.items():
        flat |= _flat(value, f"{prefix}.{name}" if prefix else str(name))
    return flat
