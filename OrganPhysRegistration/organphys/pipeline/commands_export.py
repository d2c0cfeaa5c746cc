"""organphys export: a registered organ, or a moment of its simulation, for other programs."""

from __future__ import annotations

import argparse
from dataclasses import dataclass

import numpy as np

from ..asset.asset_file import load_asset
from ..asset.registered_organ import RegisteredOrgan
from ..exports.baked_colours import baked_colours
from ..exports.reduced_model import write_reduced_model
from ..exports.splat_frames import FollowingSplat
from ..exports.surface_files import write_surface
from ..exports.surface_mesh import in_frame, surface_mesh
from ..exports.tetrahedra import TetrahedralMesh, check_tetrahedra, tetrahedra
from ..exports.tetrahedra_files import write_tetrahedra
from ..ground.checks import Array, InputError
from ..ground.progress import Progress
from ..readers.gaussian_ply import read_gaussians
from ..simulation.organ_body import metres_per_unit
from ..simulation.session import Recording, Snapshot
from .processor import one_blas_thread
from .recorded_moment import moment_at, recording_of
from .recorded_splat import write_splat_frames
from .simulated_organ import body_from_options, camera_of
from .terminal_progress import shown_progress

SURFACES, TETRAHEDRA = ("stl", "obj", "ply", "vtp"), ("vtu", "msh")


@dataclass(frozen=True)
class _Source:
    """The organ, and the recording with the number of the organ's body in it, if one is named."""

    organ: RegisteredOrgan
    recording: Recording | None = None
    index: int = 0

    def moved(self, moment: Snapshot, points_m: Array) -> Array:
        """Rest positions (N, 3) m as they are at a moment."""
        body, z = moment.scene.bodies[self.index], moment.state.bodies[self.index].z
        moved: Array = points_m + body.basis.phi(points_m) @ z
        return moved


@one_blas_thread
def run(arguments: argparse.Namespace) -> None:
    """The command with its parsed options; InputError for what cannot be used."""
    _check(arguments)
    with shown_progress(quiet=arguments.quiet) as progress:
        source = _Source(load_asset(arguments.asset))
        if arguments.recording is not None:
            source = _Source(source.organ, *recording_of(arguments.recording, source.organ))
        if arguments.format in SURFACES:
            lines = _surface(arguments, source, progress)
        elif arguments.format in TETRAHEDRA:
            lines = _tetrahedra(arguments, source, progress)
        elif arguments.format == "npz":
            progress("build the reduced model", 0.0)
            write_reduced_model(arguments.out, source.organ, body_from_options(source.organ, arguments))
            lines = ["reduced model in metres, kilograms, newtons; its array 'about' says what each array is"]
        else:
            lines = _splat(arguments, source, progress)
    if not arguments.quiet:
        print("\n".join([*lines, str(arguments.out)]))


def _check(arguments: argparse.Namespace) -> None:
    """Options that do not go together."""
    if arguments.format == "splat" and (arguments.splat is None or arguments.recording is None):
        raise InputError("--format splat: name the splat with --splat and the recording with --recording")
    if arguments.at is not None and arguments.recording is None:
        raise InputError("--at: a moment of which recording? name it with --recording")
    if arguments.at == "all" and arguments.format != "splat":
        raise InputError("--at all: only for --format splat; for one moment give its time in s")
    if arguments.format == "npz" and arguments.recording is not None:
        raise InputError("--format npz: the reduced model is that of the organ at rest; leave --recording out")
    if arguments.format in TETRAHEDRA:
        check_tetrahedra()
    _time(arguments)


def _time(arguments: argparse.Namespace) -> float | None:
    if arguments.at is None or arguments.at == "all":
        return None
    try:
        return float(arguments.at)
    except ValueError as error:
        raise InputError(f"--at: expected seconds or all, got {arguments.at!r}") from error


def _moment(arguments: argparse.Namespace, source: _Source, progress: Progress) -> Snapshot | None:
    if source.recording is None:
        return None
    return moment_at(source.recording, _time(arguments), progress=progress)


def _surface(arguments: argparse.Namespace, source: _Source, progress: Progress) -> list[str]:
    organ, moment = source.organ, _moment(arguments, source, progress)
    vertices = None
    if moment is not None:
        vertices = moment.scene.bodies[source.index].vertices(moment.state.bodies[source.index].z)
    mesh = surface_mesh(organ, frame=arguments.frame, vertices_m=vertices)
    lines = [f"{len(mesh.vertices)} vertices, {len(mesh.faces)} triangles; {mesh.comment}"]
    if arguments.splat is not None:
        if arguments.format == "stl":
            raise InputError("--splat: STL holds no colours; take ply, obj or vtp")
        progress("bake the colours", 0.0)
        colours, seen = baked_colours(organ, read_gaussians(arguments.splat), camera=camera_of(organ))
        mesh = mesh.coloured(colours)
        lines.append(f"colours of the splat on {100 * seen:.0f} % of the vertices, the hidden rest in a neutral beige")
    write_surface(arguments.out, mesh, format=arguments.format)
    return lines


def _tetrahedra(arguments: argparse.Namespace, source: _Source, progress: Progress) -> list[str]:
    organ = source.organ
    unit = metres_per_unit(organ)
    progress("tetrahedra", 0.0)
    mesh = tetrahedra(organ.scene_vertices * unit, organ.faces, edge=1e-3 * arguments.edge_mm)
    moment = _moment(arguments, source, progress)
    if moment is not None:
        mesh = TetrahedralMesh(source.moved(moment, mesh.nodes), mesh.cells)
    quality = mesh.quality()
    if not mesh.volumes.min() > 0:
        raise InputError("tetrahedra: some are turned inside out at this moment; take shorter edges, or another moment")
    placed = TetrahedralMesh(in_frame(organ, mesh.nodes / unit, arguments.frame), mesh.cells)
    write_tetrahedra(arguments.out, placed, frame=arguments.frame, name=organ.name, format=arguments.format)
    volume = 1e6 * quality.volume
    own = organ.volume_ml * float(np.mean(np.linalg.det(organ.deformation_gradient(organ.volume_points))))
    return [
        f"{quality.nodes} nodes, {quality.tetrahedra} tetrahedra, all positively oriented",
        f"radius ratio (1: regular) least {quality.min_radius_ratio:.2f}, mean {quality.mean_radius_ratio:.2f}; least "
        f"scaled Jacobian {quality.min_scaled_jacobian:.2f}",
        f"volume {volume:.1f} ml, {100 * (volume / own - 1):+.1f} % of the registered organ's {own:.1f} ml",
    ]


def _splat(arguments: argparse.Namespace, source: _Source, progress: Progress) -> list[str]:
    recording = source.recording
    assert recording is not None
    body, gaussians = recording.start.scene.bodies[source.index], read_gaussians(arguments.splat)
    once = arguments.at != "all"
    unit, distance = metres_per_unit(source.organ), 1e-3 * arguments.follow_mm
    splat = FollowingSplat(gaussians, body, unit, index=source.index, once=once, distance=distance)
    bound = len(splat.binding(recording.start).index)
    told = f"{len(gaussians)} Gaussians in their order, {bound} of them follow the organ"
    if once:
        splat.write(arguments.out, moment_at(recording, _time(arguments), progress=progress))
        return [told]
    return [told, f"{write_splat_frames(arguments.out, recording, splat, progress=progress)} frames"]
