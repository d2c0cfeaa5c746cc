"""The splat: its Gaussians as the simulator binds them, whole from the file or as the node holds them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from vtk.util.numpy_support import vtk_to_numpy

from organphys.ground.checks import InputError
from organphys.points.gaussians import SH_C0, Gaussians, logit_from_opacity
from organphys.readers.gaussian_ply import read_gaussians
from OrganPhysRegistrationLib.inputs.splat_node import ARRAYS, checked_splat

SHOWN = 0.1  # opacity below which a Gaussian is not drawn, as in the registration
FEW = np.float32(1e-12)


def node_arrays(node: Any) -> dict[str, Any]:
    """Copies of centres (N, 3), colour (N, 3) uint8, opacity (N,), scale (N, 3), rotation (N, 4), valid (N,)."""
    poly = checked_splat(node).GetPolyData()
    out = {name: vtk_to_numpy(poly.GetPointData().GetArray(name)).copy() for name in ARRAYS}
    return out | {"centres": vtk_to_numpy(poly.GetPoints().GetData()).copy()}


def gaussians_of_node(node: Any) -> Gaussians:
    """What the node holds of its Gaussians, raw scene units; without higher spherical harmonics."""
    a = node_arrays(node)
    count = len(a["centres"])
    return Gaussians(
        means=a["centres"],
        log_scales=np.log(np.maximum(a["scale"], FEW)),
        quaternions=a["rotation"],
        opacity_logits=logit_from_opacity(a["opacity"].astype(np.float64)),
        sh_dc=(a["colour"] / 255 - 0.5) / SH_C0,
        sh_rest=np.zeros((count, 3, 0), dtype=np.float32),
        valid=a["valid"] != 0,
    )


@dataclass(frozen=True)
class SplatFile:
    """The file that the splat node ``name`` with ``count`` Gaussians came from, free of nodes."""

    path: str
    name: str
    count: int

    def read(self) -> Gaussians:
        """All the file has, for export. InputError: the file is gone or is another one."""
        gaussians = read_gaussians(self.path)
        if len(gaussians) != self.count:
            raise InputError(f"{self.path}: holds another number of Gaussians than {self.name}; load the splat again")
        return gaussians


def file_of(node: Any) -> SplatFile:
    """Where a splat came from. InputError: it does not say."""
    path = checked_splat(node).GetAttribute("OrganPhys.SplatFile")
    if not path:
        raise InputError(f"splat: {node.GetName()} does not say which file it came from; load its .ply again")
    return SplatFile(path, node.GetName(), node.GetPolyData().GetNumberOfPoints())


def gaussians_of_file(node: Any) -> Gaussians:
    """All that the file of a splat has."""
    return file_of(node).read()


def shown_rows(node: Any) -> Any:
    """Rows (M,) of the Gaussians that are drawn."""
    a = node_arrays(node)
    return np.flatnonzero((a["valid"] != 0) & (a["opacity"] > SHOWN))
