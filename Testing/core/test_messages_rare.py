"""Messages of states that files and scenes hardly ever come to, as far as no other test raises them."""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from asset_examples import bent_organ
from simulation_examples import box_body
from test_messages_archives import cloud
from test_messages_readers import nifti

from organphys.asset.array_archive import archive_bytes, read_archive
from organphys.asset.asset_file import asset_bytes, asset_from_bytes
from organphys.exports import recording_file, tetrahedra
from organphys.ground.atomic_file import unwritable
from organphys.ground.checks import InputError
from organphys.pipeline import commands_export, simulation_run
from organphys.pipeline.case_file import CASE, HEADER, load_case, save_case
from organphys.pipeline.default_grasp import default_grasp
from organphys.pipeline.registration import RegisterOptions
from organphys.pipeline.server_requests import Requests
from organphys.readers import label_volume
from organphys.readers.nrrd_header import read_nrrd
from organphys.readers.ply_header import read_ply_header
from organphys.readers.stored_volume import declared_volume
from organphys.readers.volume_checks import check_is_volume_file
from organphys.simulation.psm_trajectory import Reach
from organphys.simulation.psm_trocar import trocar_at
from organphys.simulation.scene import Scene
from organphys.simulation.session import Recording, Simulation
from organphys.simulation.state import ToolPose
from organphys.simulation.tools import probe


@cache
def recording() -> Recording:
    scene = Scene((box_body(handles=4, sample_spacing=2e-2),), (probe(),))
    return Simulation(scene, scene.initial_state(ToolPose(np.array([0.05, 0.02, 0.3])))).recording()


def with_state(**changes: Any) -> Recording:
    start = recording().start
    return replace(recording(), start=start._replace(state=replace(start.state, **changes)))


def odd_body() -> Recording:
    (body,) = recording().start.state.bodies
    return with_state(bodies=(replace(body, z=body.z[:-1]),))


RECORDINGS: dict[str, Callable[[], Recording]] = {
    "different numbers of bodies or tools": lambda: with_state(tools=()),
    "does not fit its basis": odd_body,
    "str is no event": lambda: replace(recording(), events=("later",)),
}


@pytest.mark.parametrize("words", RECORDINGS)
def test_recordings_whose_parts_do_not_fit(words: str) -> None:
    with pytest.raises(InputError, match=words):
        recording_file._checked(RECORDINGS[words]())


def test_moves_of_different_lengths() -> None:
    moves = recording_file._stacked((), 1) | {"move_dt": np.zeros(3)}
    with pytest.raises(InputError, match="the moves have arrays of different lengths"):
        recording_file._events([], moves)


def test_a_map_that_leads_nowhere(tmp_path: Path) -> None:
    organ = bent_organ()
    (tmp_path / "whole").write_bytes(asset_bytes(organ))
    header, arrays = read_archive(tmp_path / "whole", "organ.json")
    signs = np.sign(organ.basis.phi(organ.normalisation.apply(organ.vertices[:1])))
    huge = archive_bytes("organ.json", header, arrays | {"z": np.repeat(1e12 * signs.T, 3, axis=1)})
    with pytest.raises(InputError, match="a map without finite places"):
        asset_from_bytes(huge)


def test_a_case_with_an_option_of_another_kind(tmp_path: Path) -> None:
    save_case(
        tmp_path, mask=np.ones((4, 4, 4), dtype=bool), ijk_to_ras=np.eye(4), splat=cloud(), options=RegisterOptions()
    )
    header, arrays = read_archive(tmp_path / CASE, HEADER)
    header["options"]["seed"] = "first"
    (tmp_path / CASE).write_bytes(archive_bytes(HEADER, header, arrays, sort_keys=False))
    with pytest.raises(InputError, match="case: seed is 'first'; write the case again"):
        load_case(tmp_path / CASE)


def test_tetrahedra_that_cannot_be(monkeypatch: pytest.MonkeyPatch) -> None:
    pytetwild = pytest.importorskip("pytetwild", reason="needs the extra tetrahedra")
    none = np.zeros((0, 3)), np.zeros((0, 4), dtype=int)
    monkeypatch.setattr(pytetwild, "tetrahedralize", lambda *_, **__: none)
    organ = bent_organ()
    with pytest.raises(InputError, match="tetrahedra: none could be made of this surface"):
        tetrahedra.tetrahedra(organ.vertices, organ.faces, edge=10.0)
    turned = tetrahedra.TetrahedralMesh(np.eye(4, 3)[[1, 0, 2, 3]], np.array([[3, 0, 1, 2]]))
    turned = (
        turned if turned.volumes[0] < 0 else tetrahedra.TetrahedralMesh(turned.nodes, turned.cells[:, [1, 0, 2, 3]])
    )
    monkeypatch.setattr(commands_export, "tetrahedra", lambda *_, **__: turned)
    with pytest.raises(InputError, match="some are turned inside out at this moment"):
        commands_export._tetrahedra(
            argparse.Namespace(edge_mm=10.0), SimpleNamespace(organ=organ, recording=None), lambda *_: None
        )  # type: ignore[arg-type]


def test_a_disk_that_refuses() -> None:
    told = str(unwritable(Path("out"), PermissionError(13, "Permission denied")))
    assert told == "out: cannot be written (Permission denied); choose another output folder, where you may write"


def test_places_from_which_nothing_can_be_done() -> None:
    body = box_body(handles=4, sample_spacing=2e-2)
    middle, up = body.samples.vertices.mean(0), np.array([0.0, 0.0, 0.5])
    with pytest.raises(InputError, match="camera and trocar see no part of the organ in common"):
        default_grasp(body, middle + up, middle - up)
    with pytest.raises(InputError, match="trocar: 0 mm from the organ; at least 5 mm are needed"):
        trocar_at(body.samples.vertices[0], body.samples.vertices)


def test_an_arm_that_turns_back() -> None:
    path = SimpleNamespace(clamped=np.zeros((2, 7), dtype=bool), jumps=np.array([False, True]))
    (notice,) = Reach(np.array([0.0, 2.5]), path, (), np.zeros(2, dtype=bool)).notices()  # type: ignore[arg-type]
    assert notice.code == "psm_roll" and "turns back by 360 deg at 2.5 s" in notice.message


def test_tissue_that_slips(monkeypatch: pytest.MonkeyPatch) -> None:
    class Held(list):  # type: ignore[type-arg]
        notices = property(lambda self: told)
        held = (0, 40, 3)
        add = list.append

    told: list[Any] = []
    monkeypatch.setattr(simulation_run, "SimulationLog", Held)
    monkeypatch.setattr(simulation_run, "_steps", lambda *_: iter(()))
    monkeypatch.setattr(simulation_run, "Simulation", lambda *_, **__: SimpleNamespace(recording=lambda: None))
    poses = [SimpleNamespace(jaw_deg=60.0), SimpleNamespace(jaw_deg=0.0)]
    plan = SimpleNamespace(scene=SimpleNamespace(initial_state=lambda _: None), poses=poses, detail=None)
    simulation_run.run_plan(plan, lambda _: None)  # type: ignore[arg-type]
    assert told[0].code == "slipped" and "3 of 40 caught samples" in told[0].message


def test_requests_too_early_or_into_nowhere(tmp_path: Path) -> None:
    requests = Requests(None, tmp_path)  # type: ignore[arg-type]
    requests._session = SimpleNamespace(registration=SimpleNamespace(organ=None), settle=lambda progress: None)  # type: ignore[assignment]
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="grids: the elastic stage has not been run yet"):
        requests._grids(SimpleNamespace(fields={}), lambda *_: None)  # type: ignore[arg-type]
    with pytest.raises(InputError, match=r"cannot be made \(.*\); choose another folder"):
        requests._report(SimpleNamespace(fields={"folder": "file/in"}), lambda *_: None)  # type: ignore[arg-type]


class Refusing:
    """A reader of label maps that fails at everything."""

    def ReadImageInformation(self) -> None:
        raise RuntimeError("itk: no")

    Execute = ReadImageInformation


def test_label_maps_that_the_library_refuses(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.nii"
    path.write_bytes(nifti())
    header = label_volume.read_header(path)
    with monkeypatch.context() as patch:
        patch.setattr(label_volume, "declared_volume", lambda _: SimpleNamespace(voxels=9))
        with pytest.raises(InputError, match="its header can be understood in two ways"):
            label_volume.read_header(path)
    monkeypatch.setattr(label_volume, "_reader", lambda _: Refusing())
    with pytest.raises(InputError, match=r"not readable as a label map .*; save it anew"):
        label_volume.read_header(path)
    with pytest.raises(InputError, match=r"damaged or incomplete .*; copy it again with all its parts"):
        list(label_volume.slabs(header))
    with pytest.raises(InputError, match="pixel type 'complex of 32-bit float' is no label type"):
        label_volume._bytes_per_voxel("complex of 32-bit float", path)


def test_a_nrrd_that_ends_in_its_header(tmp_path: Path) -> None:
    fields = "type: uchar\ndimension: 3\nsizes: 2 2 2\nencoding: raw\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n"
    (tmp_path / "a.nrrd").write_text(f"NRRD0004\n{fields}")
    with pytest.raises(InputError, match="no voxels below the header; copy the file again"):
        read_nrrd(tmp_path / "a.nrrd")


UNREADABLE: dict[str, Callable[[Path], object]] = {
    "(Permission denied); check its permissions": read_ply_header,
    "(Permission denied); copy the file again": declared_volume,
    "cannot be read; check its permissions": check_is_volume_file,
}


@pytest.mark.parametrize("words", UNREADABLE)
def test_files_that_may_not_be_read(words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The system's refusal is made: root may read everything."""

    def refused(*_: object, **__: object) -> None:
        raise PermissionError(13, "Permission denied")

    path = tmp_path / "a.nii"
    path.write_bytes(nifti())
    with monkeypatch.context() as patch:
        patch.setattr("os.access", lambda *_: False)
        patch.setattr(Path, "open", refused)
        with pytest.raises(InputError, match=re.escape(words)):
            UNREADABLE[words](path)
