"""What other programs get: surfaces that say their frame, colours, tetrahedra, and a reduced model that can be used."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from asset_examples import bent_organ
from simulation_examples import BOTTOM, SIZE, box_body, box_surface

from organphys.asset.registered_organ import RegisteredOrgan
from organphys.asset.surface_distance import vertex_normals
from organphys.exports.baked_colours import HIDDEN, baked_colours
from organphys.exports.reduced_model import ARRAYS, reduced_arrays
from organphys.exports.splat_frames import FollowingSplat, frame_name
from organphys.exports.surface_files import write_surface
from organphys.exports.surface_mesh import surface_mesh
from organphys.exports.tetrahedra import TetrahedralMesh, oriented, tetrahedra
from organphys.exports.tetrahedra_files import write_tetrahedra
from organphys.ground.checks import InputError
from organphys.points.gaussians import SH_C0, Gaussians
from organphys.readers.gaussian_ply import read_gaussians
from organphys.simulation.pins import Pin
from organphys.simulation.scene import Scene
from organphys.simulation.session import Simulation, Snapshot
from organphys.simulation.state import BodyState, SceneState


@pytest.fixture(scope="module")
def organ() -> RegisteredOrgan:
    return bent_organ()


def splat(means: np.ndarray, colour: np.ndarray) -> Gaussians:
    count = len(means)
    return Gaussians(
        means=means.astype(np.float32),
        log_scales=np.full((count, 3), -5.0, np.float32),
        quaternions=np.tile(np.float32([1, 0, 0, 0]), (count, 1)),
        opacity_logits=np.full(count, 4.0, np.float32),
        sh_dc=((colour - 0.5) / SH_C0 * np.ones((count, 1))).astype(np.float32),
        sh_rest=np.zeros((count, 3, 0), np.float32),
        valid=np.ones(count, dtype=bool),
    )


def read_surface(path: Path) -> tuple[np.ndarray, np.ndarray | None, str]:
    """Points, colours and the text that tells the frame, by VTK's own readers."""
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOGeometry import vtkOBJReader, vtkSTLReader
    from vtkmodules.vtkIOPLY import vtkPLYReader
    from vtkmodules.vtkIOXML import vtkXMLPolyDataReader

    kinds = {".stl": vtkSTLReader, ".obj": vtkOBJReader, ".ply": vtkPLYReader, ".vtp": vtkXMLPolyDataReader}
    reader = kinds[path.suffix]()
    reader.SetFileName(str(path))
    reader.Update()
    data = reader.GetOutput()
    scalars = data.GetPointData().GetScalars()
    text = path.read_bytes()[:200].decode("latin-1")
    if path.suffix == ".vtp":
        text = data.GetFieldData().GetAbstractArray("FRAME").GetValue(0)
    points = vtk_to_numpy(data.GetPoints().GetData())
    return points, None if scalars is None else vtk_to_numpy(scalars), text


@pytest.mark.parametrize("format", ["stl", "obj", "ply", "vtp"])
@pytest.mark.parametrize(
    ("frame", "unit_mm", "words"), [("scene", 100.0, "scene units"), ("ct", 1.0, "RAS, mm"), ("m", 1000.0, "metres")]
)
def test_surfaces_tell_their_frame_and_have_its_size(organ, tmp_path, format, frame, unit_mm, words) -> None:
    path = tmp_path / f"organ.{format}"
    mesh = surface_mesh(organ, frame=frame)
    write_surface(path, mesh if format == "stl" else mesh.coloured(np.full((len(mesh.vertices), 3), [1.0, 0.5, 0.0])))
    points, colours, text = read_surface(path)
    assert words in text
    assert np.ptp(points, axis=0).max() * unit_mm == pytest.approx(
        np.ptp(mesh.vertices, axis=0).max() * unit_mm, rel=1e-5
    )
    assert 100 < np.ptp(points, axis=0).max() * unit_mm < 140  # the ellipsoid is 120 mm long
    if format in ("ply", "vtp"):
        assert np.array_equal(np.unique(colours, axis=0), [[255, 128, 0]])


def test_a_written_obj_has_colours_and_faces_that_look_outward(organ, tmp_path) -> None:
    mesh = surface_mesh(organ, frame="m").coloured(np.full((len(organ.vertices), 3), 0.25))
    write_surface(tmp_path / "o.obj", mesh)
    rows = (tmp_path / "o.obj").read_text().splitlines()
    vertices = np.array([line.split()[1:] for line in rows if line.startswith("v ")], dtype=float)
    faces = np.array([line.split()[1:] for line in rows if line.startswith("f ")], dtype=int) - 1
    assert vertices.shape[1] == 6 and np.allclose(vertices[:, 3:], 0.25, atol=0.003)
    a, b, c = (vertices[faces[:, k], :3] for k in range(3))
    volume = np.einsum("nd,nd->", a, np.cross(b, c)) / 6
    assert volume == pytest.approx(1e-6 * organ.volume_ml, rel=0.03)


def test_seen_vertices_take_the_splat_s_colour_and_hidden_ones_the_neutral_one(organ) -> None:
    vertices = organ.scene_vertices
    front = vertices[(vertex_normals(vertices, organ.faces) * -vertices).sum(1) > 0]
    red = splat(front, np.array([0.8, 0.2, 0.1]))
    red.opacity_logits[::2] = -9.0  # invisible ones have another colour, which must not be taken
    red.sh_dc[::2] = 1.5
    with pytest.raises(InputError, match="right splat"):
        baked_colours(organ, splat(front + 5.0, np.zeros(3)))
    colours, share = baked_colours(organ, red, reach_mm=8.0)
    hidden = np.isclose(colours, HIDDEN).all(1)
    assert 0.35 < share < 0.75 and hidden.mean() == pytest.approx(1 - share)
    assert np.allclose(colours[~hidden], [0.8, 0.2, 0.1], atol=1e-4)


def test_quality_of_known_tetrahedra() -> None:
    regular = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1.0]])
    mesh = oriented(np.concatenate([regular, [[9, 9, 9.0]]]), np.array([[0, 2, 1, 3], [0, 1, 2, 3]]))
    assert (mesh.volumes > 0).all() and len(mesh.nodes) == 4
    assert mesh.volumes == pytest.approx(8 / 3)
    assert mesh.radius_ratios == pytest.approx(1) and mesh.scaled_jacobians == pytest.approx(1)
    corner = TetrahedralMesh(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]]), np.array([[0, 1, 2, 3]]))
    inner, outer = 1 / (3 + np.sqrt(3)), np.sqrt(3) / 2
    assert corner.radius_ratios == pytest.approx(3 * inner / outer)
    assert corner.scaled_jacobians == pytest.approx(np.sqrt(2) / 2)


@pytest.mark.parametrize("format", ["vtu", "msh"])
def test_tetrahedra_fill_the_box_and_read_back(tmp_path, monkeypatch, format) -> None:
    for name in ("pytetwild", "meshio"):
        pytest.importorskip(name, reason="the extra 'tetrahedra' is not installed", exc_type=ImportError)
    import meshio

    monkeypatch.chdir(tmp_path)
    mesh = tetrahedra(*box_surface(SIZE, 0.01), edge=0.02)
    assert list(tmp_path.iterdir()) == []  # fTetWild's own file is not left behind
    quality = mesh.quality()
    assert mesh.volumes.min() > 0 and quality.min_radius_ratio > 0.05 and quality.mean_radius_ratio > 0.6
    assert quality.volume == pytest.approx(SIZE.prod(), rel=0.05)
    path = tmp_path / f"box.{format}"
    write_tetrahedra(path, mesh, frame="m", name="box")
    assert b"box; splat file's axes, metres" in path.read_bytes()[:200]
    again = meshio.read(path)
    assert np.array_equal(again.cells_dict["tetra"], mesh.cells) and np.allclose(again.points, mesh.nodes)
    if format == "vtu":
        assert np.allclose(again.cell_data["radius_ratio"][0], mesh.radius_ratios)


def test_without_the_extra_the_user_is_told_what_to_install(monkeypatch) -> None:
    monkeypatch.setattr("organphys.exports.tetrahedra.NEEDED", ("no_such_module",))
    with pytest.raises(InputError, match=r"pip install 'organphys\[tetrahedra\]'"):
        tetrahedra(*box_surface(SIZE, 0.01), edge=0.02)


def test_the_reduced_model_is_that_of_the_body(organ) -> None:
    body = box_body(BOTTOM)
    model = reduced_arrays(organ, body)
    assert set(model) == set(ARRAYS)
    n = body.basis.size
    assert np.allclose(model["mass"], body.mass * np.eye(n), atol=1e-6 * body.mass)
    assert model["stiffness"].shape == (3 * n, 3 * n)
    values = np.linalg.eigvalsh(model["stiffness"])
    assert (np.abs(values[:6]) < 1e-6 * values[-1]).all() and values[6] > 1e-6 * values[-1]  # six rigid motions
    z = 1e-5 * np.random.default_rng(0).normal(size=(n, 3))
    f = np.eye(3)[:, :, None] + np.einsum("mqn,na->amq", model["quadrature_gradient"], z)
    energy = body.strain.energy_and_stress(f, None)[0]
    assert 0.5 * z.ravel() @ model["stiffness"] @ z.ravel() == pytest.approx(energy, rel=0.02)
    fall = model["mass_total"] * np.outer(model["mean_phi"], [0, 0, -9.81])
    assert np.allclose(np.linalg.solve(model["mass"], fall), np.outer(body.mean_phi, [0, 0, -9.81]))


def test_the_basis_can_be_evaluated_from_the_file_alone(organ) -> None:
    body = box_body(BOTTOM)
    m = reduced_arrays(organ, body)
    x = (m["quadrature_points"][:7] - m["centre"]) / m["length"]
    p, nodes = (
        np.column_stack([np.ones(len(x)), x]),
        np.column_stack([np.ones(len(m["node_points"])), m["node_points"]]),
    )
    kernel = np.exp(-((x[:, None] - m["node_points"]) ** 2).sum(2) / m["node_radii"] ** 2)
    moment = np.einsum("qi,ia,ib->qab", kernel, nodes, nodes)
    shapes = np.einsum("qa,ia,qi->qi", np.linalg.solve(moment, p[:, :, None])[:, :, 0], nodes, kernel)
    w = shapes @ m["node_weights"]
    handles = int(m["handles"])
    skinned = (w[:, :handles, None] * p[:, None, :]).reshape(len(x), -1)
    phi = np.column_stack([p, skinned, w[:, handles:]]) @ m["mixing"]
    assert np.allclose(phi, m["quadrature_phi"][:7], atol=1e-8)


def test_splat_frames_keep_rows_and_follow_new_pins(tmp_path) -> None:
    body = box_body(BOTTOM)
    means = np.random.default_rng(0).uniform(0, 1, (60, 3)) * SIZE / 0.1
    means[-5:] += 3.0
    gaussians = splat(means, np.array([0.5, 0.2, 0.2]))
    simulation = Simulation(Scene((body,)), Scene((body,)).initial_state())
    frames = FollowingSplat(gaussians, body, 0.1)
    simulation.set_pins(0, Pin((0.0, 0.02, 0.02), 0.02))
    now = simulation.scene.bodies[0]
    z = 2e-3 * np.random.default_rng(1).normal(size=(now.basis.size, 3))
    state = SceneState((replace(BodyState.at_rest(now.basis.size), z=z),))
    path = frame_name(tmp_path, 3)
    frames.write(path, Snapshot(simulation.scene, state))
    again = read_gaussians(path)
    assert path.name == "splat_00003.ply" and len(again) == 60
    expected = means[:55] * 0.1 + now.basis.phi(means[:55] * 0.1) @ z
    assert np.allclose(again.means[:55], expected / 0.1, atol=1e-4)
    assert np.array_equal(again.means[-5:], gaussians.means[-5:])
