"""formats.md lists the arrays that the files hold, no more and no less, with their shapes."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from asset_examples import bent_organ
from doc_pages import PAGES, names_in, table_after
from simulation_examples import box_body

from organphys.asset.array_archive import read_archive
from organphys.asset.asset_file import save_asset
from organphys.asset.organ_sequence import OrganSequence
from organphys.asset.registered_organ import RegisteredOrgan
from organphys.asset.sequence_file import save_sequence
from organphys.basis.reduced_covariance import ReducedCovariance
from organphys.exports.recording_file import save_recording
from organphys.exports.surface_vtp import write_surface_vtp
from organphys.simulation.scene import Scene
from organphys.simulation.session import Simulation
from organphys.simulation.state import ToolPose
from organphys.simulation.tools import probe

PAGE = PAGES["formats.md"]
HANDLES = 12


@pytest.fixture(scope="module")
def organ() -> RegisteredOrgan:
    plain = bent_organ()
    factor = 0.002 * np.random.default_rng(0).normal(size=(12 * HANDLES + 1, 4))
    return replace(plain, uncertainty=ReducedCovariance(factor, 6.0))


def told(heading: str) -> dict[str, tuple[str, ...]]:
    """Array -> the shape that the page gives for it."""
    rows = table_after(PAGE, heading)
    return {name: tuple(re.findall(r"[^\s(),][^,()]*", row[1])) for row in rows for name in names_in([row])}


def checked(arrays: dict[str, np.ndarray], heading: str, sizes: dict[str, int]) -> None:
    shapes = told(heading)
    assert set(arrays) == set(shapes)
    for name, array in arrays.items():
        wanted = [sizes.get(size, size) for size in shapes[name]]
        assert len(wanted) == array.ndim, name
        for size, length in zip(wanted, array.shape, strict=True):
            assert str(size).isalpha() or int(size) == length, (name, size, length)


def test_arrays_of_an_asset(organ: RegisteredOrgan, tmp_path: Path) -> None:
    save_asset(organ, tmp_path / "organ.organphys")
    _, arrays = read_archive(tmp_path / "organ.organphys", "organ.json")
    sizes = {"4H": 4 * HANDLES, "H - 1": HANDLES - 1, "12H + 1": 12 * HANDLES + 1, "Nv": len(organ.vertices)}
    checked(arrays, "## organ.organphys: the asset", sizes)


def test_arrays_of_a_sequence(organ: RegisteredOrgan, tmp_path: Path) -> None:
    T = organ.T_scene_ct
    sequence = OrganSequence(
        organ, np.arange(3.0), np.stack([organ.z] * 3), np.full(3, T.scale), np.stack([T.rotation] * 3),
        np.stack([T.translation] * 3), ("first", "tracked", "lost"), figures={"NAME": np.zeros(3)},
    )  # fmt: skip
    save_sequence(sequence, tmp_path / "organ.organphys-seq")
    _, arrays = read_archive(tmp_path / "organ.organphys-seq", "sequence.json")
    arrays["figures/NAME"] = arrays.pop("figures/name")
    checked(arrays, "## organ.organphys-seq: a sequence", {"T": 3, "4H": 4 * HANDLES})


def test_arrays_of_a_recording(tmp_path: Path) -> None:
    poses = [ToolPose(np.array([0.05, 0.02, 0.06 - 0.001 * k])) for k in range(3)]
    scene = Scene((box_body(),), (probe(),))
    simulation = Simulation(scene, scene.initial_state(poses[0]))
    for pose in poses[1:]:
        simulation.step((pose,))
    save_recording(tmp_path / "recording.npz", simulation.recording())
    _, arrays = read_archive(tmp_path / "recording.npz", "recording.json")
    moves = {name: array for name, array in arrays.items() if name.startswith("move_")}
    checked(moves, "## recording.npz", {"M": 2, "K": 1})


def test_arrays_of_the_surface(organ: RegisteredOrgan, tmp_path: Path) -> None:
    write_surface_vtp(tmp_path / "surface.vtp", organ)
    text = (tmp_path / "surface.vtp").read_bytes()
    assert {name for name in names_in(table_after(PAGE, "## surface.vtp")) if f'"{name}"'.encode() not in text} == set()
