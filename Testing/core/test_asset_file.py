"""The .organphys file: same bytes, same map, and no damage goes through."""

import io
import json
import zipfile
from pathlib import Path

import numpy as np
import pytest
from asset_examples import CENTRE_MM, bent_organ

from organphys.asset.asset_file import load_asset, save_asset
from organphys.basis.learned import LearnedWeights
from organphys.basis.reduced_basis import ReducedBasis
from organphys.ground.checks import InputError


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("asset") / "organ.organphys"
    save_asset(bent_organ(mm_per_scene_unit=98.0), path)
    return path


def rewrite(file: Path, target: Path, changes: dict[str, bytes | None], compression: int = zipfile.ZIP_STORED) -> Path:
    """Copy of the archive with members replaced, added or (None) left out."""
    with zipfile.ZipFile(file) as old, zipfile.ZipFile(target, "w", compression) as new:
        members = {name: old.read(name) for name in old.namelist()} | changes
        for name, content in members.items():
            if content is not None:
                new.writestr(name, content)
    return target


def test_loaded_asset_maps_bit_for_bit(file: Path) -> None:
    organ, again = bent_organ(mm_per_scene_unit=98.0), load_asset(file)
    points = CENTRE_MM + np.random.default_rng(0).normal(0, 50, (3000, 3))
    assert np.array_equal(organ.map_points(points), again.map_points(points))
    assert np.array_equal(organ.deformation_gradient(points), again.deformation_gradient(points))
    assert (again.name, again.mm_per_unit, again.tissue) == (organ.name, 98.0, organ.tissue)
    assert again.provenance == organ.provenance and again.volume_ml == organ.volume_ml
    assert np.array_equal(again.faces, organ.faces)


def test_same_organ_same_bytes_and_no_date(file: Path, tmp_path: Path) -> None:
    save_asset(load_asset(file), tmp_path / "b.organphys")
    assert (tmp_path / "b.organphys").read_bytes() == file.read_bytes()
    with zipfile.ZipFile(file) as archive:
        assert {m.date_time for m in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}


def test_learned_weights_come_back(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    weights = LearnedWeights(
        (rng.normal(size=(3, 8)), rng.normal(size=(8, 2))), (np.zeros(8), np.zeros(2)), np.zeros(3), 1.3
    )
    organ = bent_organ()
    learned = type(organ)(**{**vars_of(organ), "basis": ReducedBasis.plain(weights), "z": rng.normal(0, 0.01, (12, 3))})
    save_asset(learned, tmp_path / "a.organphys")
    again = load_asset(tmp_path / "a.organphys")
    assert np.array_equal(again.scene_vertices, learned.scene_vertices)


def vars_of(organ: object) -> dict[str, object]:
    return {name: getattr(organ, name) for name in organ.__dataclass_fields__}  # type: ignore[attr-defined]


@pytest.mark.parametrize("keep", [0, 10, 1000, -30, -1])
def test_truncated_file(file: Path, tmp_path: Path, keep: int) -> None:
    (tmp_path / "cut.organphys").write_bytes(file.read_bytes()[:keep])
    with pytest.raises(InputError):
        load_asset(tmp_path / "cut.organphys")


def test_flipped_byte_in_an_array(file: Path, tmp_path: Path) -> None:
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 0xFF
    (tmp_path / "bad.organphys").write_bytes(bytes(content))
    with pytest.raises(InputError, match="write or copy it again"):
        load_asset(tmp_path / "bad.organphys")


def test_newer_version_and_other_zip(file: Path, tmp_path: Path) -> None:
    header = json.loads(zipfile.ZipFile(file).read("organ.json"))
    newer = json.dumps({**header, "version": 99}).encode()
    with pytest.raises(InputError, match="update organphys"):
        load_asset(rewrite(file, tmp_path / "new.organphys", {"organ.json": newer}))
    with pytest.raises(InputError, match=r"name an \.organphys file"):
        load_asset(rewrite(file, tmp_path / "other.zip", {"organ.json": None}))
    with pytest.raises(InputError, match="check the path"):
        load_asset(tmp_path / "missing.organphys")


def npy(array: np.ndarray, *, pickle: bool = False) -> bytes:
    stream = io.BytesIO()
    np.lib.format.write_array(stream, array, allow_pickle=pickle)
    return stream.getvalue()


def huge_header() -> bytes:
    stream = io.BytesIO()
    np.lib.format.write_array_header_1_0(stream, {"descr": "<f8", "fortran_order": False, "shape": (10**12, 3)})
    return stream.getvalue()


@pytest.mark.parametrize(
    "member",
    [
        npy(np.array([{"a": 1}], dtype=object), pickle=True),
        huge_header(),
        npy(np.zeros((4, 2))),
        npy(np.full((10, 3), np.nan)),
        b"no array at all",
    ],
    ids=["object array", "a terabyte by its word", "wrong shape", "not finite", "garbage"],
)
def test_bad_array(file: Path, tmp_path: Path, member: bytes) -> None:
    with pytest.raises(InputError):
        load_asset(rewrite(file, tmp_path / "bad.organphys", {"vertices.npy": member}))


def test_damaged_headers_and_strange_members(file: Path, tmp_path: Path) -> None:
    header = json.loads(zipfile.ZipFile(file).read("organ.json"))
    for k, text in enumerate(
        [
            b"{",
            b"[]",
            b"{}",
            json.dumps({**header, "T_scene_ct": {}}).encode(),
            json.dumps({**header, "basis": 3}).encode(),
        ]
    ):
        with pytest.raises(InputError):
            load_asset(rewrite(file, tmp_path / f"{k}.organphys", {"organ.json": text}))
    with pytest.raises(InputError, match="unknown member"):
        load_asset(rewrite(file, tmp_path / "x.organphys", {"../evil.npy": b""}))
    with pytest.raises(InputError, match="compressed"):
        load_asset(rewrite(file, tmp_path / "z.organphys", {}, zipfile.ZIP_DEFLATED))
    with pytest.raises(InputError):
        load_asset(rewrite(file, tmp_path / "f.organphys", {"faces.npy": npy(np.full((5, 3), 10**6, np.int32))}))
