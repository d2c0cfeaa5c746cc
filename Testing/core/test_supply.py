"""What is delivered can be made again: locked versions, licences of all packages, versioned assets."""

from __future__ import annotations

import re
import sys
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np
import pytest

from organphys.asset.array_archive import read_archive
from organphys.asset.asset_file import VERSION, asset_bytes, asset_from_bytes, load_asset, save_asset

ROOT = Path(__file__).resolve().parents[2]
CI = ROOT / ".ci"
PYTHONS = ("3.10", "3.11", "3.12")
sys.path.insert(0, str(CI))
import licences  # noqa: E402
import requirements_closure as supply  # noqa: E402


@pytest.mark.parametrize("python", PYTHONS)
def test_one_version_of_every_package_for_every_python(python: str) -> None:
    """All that this Python's packages need is pinned; of other Pythons' packages the direct ones are known here."""
    environment, pins = supply.linux(python), supply.pins()
    running = python == f"{sys.version_info.major}.{sys.version_info.minor}"
    groups = [r for group in supply.direct_requirements().values() for r in group]
    direct = {supply.canonicalize_name(r.name) for r in groups if r.marker is None or r.marker.evaluate(environment)}
    for name in supply.closure(environment).keys() | direct - {"organphys"}:
        valid = [pin for pin in pins.get(name, []) if pin.marker is None or pin.marker.evaluate(environment)]
        versions = {str(pin.specifier) for pin in valid}
        told = f"{name} under {python}: {sorted(versions) or 'no pin'}; run make lock"
        assert len(versions) == 1 or (not versions and not running and name not in direct), told
        assert all(re.fullmatch(r"==[\w.]+", version) for version in versions), told


def test_pins_are_within_what_the_project_asks_for() -> None:
    pins = supply.pins()
    for requirements in supply.direct_requirements().values():
        for requirement in requirements:
            for pin in pins.get(supply.canonicalize_name(requirement.name), []):
                (exact,) = pin.specifier
                assert exact.version in requirement.specifier, f"{pin} is not {requirement}"


def test_torch_is_pinned() -> None:
    assert [str(pin) for pin in supply.pins()["torch"]] == ["torch==2.13.0"]


def test_every_licence_is_told() -> None:
    told = licences.written()
    assert set(told) == set(supply.pins()), "run make licences"
    assert all(licence and groups for licence, groups in told.values())
    installed = {name for name in told if licences.licence_of(name) is not None}
    assert {"numpy", "scipy", "vtk", "plyfile"} <= installed
    assert "GPL" in told["plyfile"][0]
    core = [licence for licence, groups in told.values() if groups == supply.CORE]
    assert [licence for licence in core if licences.COPYLEFT.search(licence)] == [told["plyfile"][0]]


@pytest.mark.skipif(sys.version_info[:2] != (3, 11), reason="the table is of Python 3.11, others may differ")
def test_licences_are_those_of_the_installed_packages() -> None:
    for name, (licence, _) in licences.written().items():
        if _installed_as_pinned(name):
            assert licences.licence_of(name) == licence, f"{name}: run make licences"


def _installed_as_pinned(name: str) -> bool:
    try:
        there = version(name).split("+")[0]
    except PackageNotFoundError:
        return False
    return any(pin.specifier.contains(there) for pin in supply.pins()[name])


def test_a_package_without_a_licence_is_not_passed_over(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(licences, "pins", lambda: {"a-package-of-no-one": []})
    with pytest.raises(SystemExit, match="a-package-of-no-one"):
        licences.rows()


VERSION_1 = Path(__file__).parent / "data" / "organ_version_1.organphys"
"""Written by the code of the first version: a bent ellipsoid of few points."""
POINTS_CT = [
    [25.484, -43.361, 121.638],
    [10.93, -36.429, 119.2],
    [6.88, -53.762, 105.158],
    [-4.89, -41.366, 104.443],
]
MAPPED = [  # by that code
    [0.983559521182, -0.503868560031, 2.419608121034],
    [0.838554200742, -0.534931670179, 2.45758779775],
    [0.836096217528, -0.69698754085, 2.298508336619],
    [0.68620752072, -0.66392263332, 2.37181305661],
]


def test_assets_of_version_1_still_map_as_they_did() -> None:
    assert read_archive(VERSION_1, "organ.json")[0]["version"] == 1 < VERSION
    organ = load_asset(VERSION_1)
    np.testing.assert_allclose(organ.map_points(POINTS_CT), MAPPED, atol=1e-11)
    assert (organ.name, organ.mm_per_unit, organ.uncertainty) == ("ellipsoid", 98.0, None)


def test_an_old_asset_saved_again_is_of_the_present_version(tmp_path: Path) -> None:
    organ = load_asset(VERSION_1)
    save_asset(organ, tmp_path / "new.organphys")
    assert read_archive(tmp_path / "new.organphys", "organ.json")[0]["version"] == VERSION
    again = load_asset(tmp_path / "new.organphys")
    np.testing.assert_array_equal(again.map_points(POINTS_CT), organ.map_points(POINTS_CT))
    assert again.provenance == organ.provenance == {"seed": 0}
    assert asset_bytes(asset_from_bytes(asset_bytes(again))) == asset_bytes(organ)
