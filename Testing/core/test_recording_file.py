"""Recordings on disk: they replay bit for bit, and a damaged or foreign file is refused in one line."""

import dataclasses
import json
import typing
import zipfile
from pathlib import Path

import numpy as np
import pytest
from simulation_examples import BOTTOM, box_body

from organphys.exports.recording_file import load_recording, save_recording, seal
from organphys.ground.checks import InputError
from organphys.ground.frames import rotation_about
from organphys.simulation.local_detail import LocalDetail
from organphys.simulation.options import SimulationOptions, gravity_along
from organphys.simulation.pins import Pin
from organphys.simulation.record_tree import COMPUTED, RECORDS, RecordTable
from organphys.simulation.scene import Scene
from organphys.simulation.session import Simulation, Snapshot, replay
from organphys.simulation.state import ToolPose
from organphys.simulation.tools import gripper


def poke(k: int) -> ToolPose:
    """Jaws that come down on the box, tilted, and close."""
    turn = rotation_about(np.array([1.0, 0, 0]), np.pi - 0.01 * k)
    return ToolPose(np.array([0.05, 0.02, 0.056 - 0.001 * k]), turn, 40.0 - 4 * k)


@pytest.fixture(scope="module")
def simulation() -> Simulation:
    """Local detail, a snapshot in the middle of a touch, new pins and other options on the way."""
    scene = Scene((box_body(BOTTOM),), (gripper(),), SimulationOptions(gravity=gravity_along([0, 0, -1])))
    simulation = Simulation(scene, scene.initial_state(poke(0)), detail=LocalDetail(radius=0.008, count=6))
    for k in range(8):
        simulation.step((poke(k),))
    simulation.restore(simulation.snapshot)
    for k in range(8, 11):
        simulation.step((poke(k),), dt=1 / 50)
    simulation.set_pins(0, Pin((0.0, 0.02, 0.02), 0.02))
    simulation.set_options(SimulationOptions(scheme="bdf2", friction=0.0))
    simulation.step((poke(11),))
    return simulation


@pytest.fixture(scope="module")
def path(simulation: Simulation, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("recording") / "touch.npz"
    save_recording(path, simulation.recording())
    return path


def test_a_loaded_recording_replays_bit_for_bit(simulation: Simulation, path: Path) -> None:
    assert simulation.scene.bodies[0].basis.local is not None  # the hard case: local functions in the file
    mine, again = simulation.recording(), load_recording(path)
    assert len(again.events) == 6 and again.detail == mine.detail
    moments = replay(again)
    for one, other in zip(replay(mine), moments, strict=True):
        assert one.state.time == other.state.time
        for name in ("z", "velocity", "z_before"):
            assert np.array_equal(getattr(one.state.bodies[0], name), getattr(other.state.bodies[0], name)), name
    assert np.array_equal(moments[-1].state.bodies[0].z, simulation.state.bodies[0].z)


def test_the_same_recording_gives_the_same_bytes(simulation: Simulation, path: Path, tmp_path: Path) -> None:
    save_recording(tmp_path / "again.npz", simulation.recording())
    assert (tmp_path / "again.npz").read_bytes() == path.read_bytes()


def test_numpy_reads_the_moves_without_pickle(simulation: Simulation, path: Path) -> None:
    with np.load(path, allow_pickle=False) as arrays:
        assert arrays["move_position"].shape == (4, 1, 3)
        assert np.array_equal(arrays["move_jaw_deg"][:, 0], [poke(k).jaw_deg for k in range(8, 12)])
        assert np.allclose(arrays["move_dt"], [1 / 50] * 3 + [1 / 60])


def test_every_record_that_a_recording_may_hold_can_be_written() -> None:
    found, waiting = set(), [Snapshot]
    while waiting:
        record = waiting.pop()
        for part in typing.get_type_hints(record).values():
            for kind in (part, *typing.get_args(part)):
                is_record = isinstance(kind, type) and (dataclasses.is_dataclass(kind) or hasattr(kind, "_fields"))
                if is_record and kind not in found:
                    found.add(kind)
                    waiting.append(kind)
    abstract = {"NeoHookean"}
    assert {k.__name__ for k in found - set(COMPUTED)} - abstract <= set(RECORDS)


def changed(path: Path, out: Path, edit: typing.Callable[[dict], None], drop: str = "") -> Path:
    """The recording edited, with a seal that fits again."""
    arrays = dict(np.load(path, allow_pickle=False))
    arrays = {
        name: value for name, value in arrays.items() if name not in ("recording.json", drop.removesuffix(".npy"))
    }
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(out, "w") as new:
        for member in old.namelist():
            content = old.read(member)
            if member == "recording.json":
                header = json.loads(content)
                edit(header)
                header["seal"] = seal({k: v for k, v in header.items() if k != "seal"}, arrays)
                content = json.dumps(header).encode()
            if member != drop:
                new.writestr(member, content)
    return out


@pytest.mark.parametrize(
    ("edit", "drop", "message"),
    [
        (lambda h: h.update(version=1), "", "version 1.*record again"),
        (lambda h: h.update(format="other"), "", "no recording"),
        (lambda h: h["start"].update(record="os.system"), "", "damaged.*not known"),
        (lambda h: h["start"]["fields"].update(more=1), "", "damaged.*other fields"),
        (lambda h: h.update(events=[7]), "", "another number of moves"),
        (lambda h: h.update(start=None), "", "no snapshot"),
        (lambda h: None, "move_jaw_deg.npy", "damaged"),
    ],
)
def test_foreign_and_damaged_files_are_refused(path, tmp_path, edit, drop, message) -> None:
    with pytest.raises(InputError, match=message):
        load_recording(changed(path, tmp_path / "bad.npz", edit, drop))


def test_a_number_changed_since_is_told_by_the_seal(path: Path, tmp_path: Path) -> None:
    changed(path, tmp_path / "edited.npz", lambda header: header.update(organphys="9.9"))
    with zipfile.ZipFile(tmp_path / "edited.npz") as edited, zipfile.ZipFile(path) as whole:
        members = {name: edited.read(name) for name in edited.namelist()}
        old = json.loads(whole.read("recording.json"))["seal"]
    header = json.loads(members["recording.json"])
    members["recording.json"] = json.dumps(header | {"seal": old}).encode()
    with zipfile.ZipFile(tmp_path / "again.npz", "w") as out:
        for name, content in members.items():
            out.writestr(name, content)
    assert load_recording(tmp_path / "edited.npz")
    with pytest.raises(InputError, match="seal does not fit"):
        load_recording(tmp_path / "again.npz")


def test_truncated_and_missing_files_are_refused(path: Path, tmp_path: Path) -> None:
    (tmp_path / "half.npz").write_bytes(path.read_bytes()[:5000])
    for name in ("half.npz", "none.npz"):
        with pytest.raises(InputError, match=name):
            load_recording(tmp_path / name)


def test_what_is_no_record_is_not_written() -> None:
    for value in (object(), [1], {"a": 1}, float("nan")):
        with pytest.raises(TypeError):
            RecordTable().tree(value)
