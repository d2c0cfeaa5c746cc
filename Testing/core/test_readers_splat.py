"""Splat PLY files in every dialect, masked non-finite Gaussians, damaged files."""

import numpy as np
import pytest
from reader_samples import ply_bytes, splat_columns

from organphys.ground.checks import InputError
from organphys.points.gaussians import LOGIT_LIMIT, colour_from_sh, logit_from_opacity
from organphys.readers import ply_columns
from organphys.readers.gaussian_ply import describe_splat, read_gaussians, read_splat

XYZ = ["x", "y", "z"]


def stacked(columns, names):
    return np.stack([columns[n] for n in names], axis=1)


def write(path, elements, order="<", **options):
    path.write_bytes(ply_bytes(elements, order, **options))
    return path


@pytest.mark.parametrize("order", ["<", ">", "a"])
@pytest.mark.parametrize("dtype", ["f4", "f8"])
@pytest.mark.parametrize("degree", [0, 1, 2, 3])
def test_inria_layout_in_every_encoding(tmp_path, order, dtype, degree):
    columns = splat_columns(40, degree=degree, normals=degree % 2 == 0, dtype=dtype)
    columns["confidence"] = np.arange(40, dtype="i4")
    path = write(tmp_path / "a.ply", {"vertex": columns}, order)
    cloud, full, info = read_splat(path), read_gaussians(path), describe_splat(path)
    assert np.array_equal(cloud.centres, stacked(columns, XYZ)) and cloud.centres.dtype.str[1:] == dtype
    assert np.allclose(cloud.opacities, 1 / (1 + np.exp(-columns["opacity"])), atol=1e-6)
    colour = np.clip(0.5 + 0.28209479 * stacked(columns, [f"f_dc_{i}" for i in range(3)]), 0, 1)
    assert np.allclose(cloud.colours, colour, atol=1e-6)
    assert cloud.valid.all() and cloud.notices == ()
    assert np.array_equal(full.quaternions, stacked(columns, [f"rot_{i}" for i in range(4)]))
    assert np.array_equal(full.log_scales, stacked(columns, [f"scale_{i}" for i in range(3)]))
    assert np.array_equal(full.opacity_logits, columns["opacity"])
    per_channel = (degree + 1) ** 2 - 1
    assert full.sh_rest.shape == (40, 3, per_channel) and full.sh_degree == info.sh_degree == degree
    for channel in range(3 * (degree > 0)):  # channel-major
        assert np.array_equal(full.sh_rest[:, channel, 1], columns[f"f_rest_{channel * per_channel + 1}"])
    assert np.array_equal(full.extra["confidence"], np.arange(40)) and full.extra["confidence"].dtype.isnative
    assert ("nx" in full.extra) == (degree % 2 == 0)
    assert info.kind == "3D Gaussians" and info.count == 40


def test_2d_gaussians_and_plain_points(tmp_path):
    flat = write(tmp_path / "2d.ply", {"vertex": splat_columns(scales=2)})
    assert read_gaussians(flat).log_scales.shape == (50, 2) and describe_splat(flat).kind == "2D Gaussians"
    columns = {n: np.arange(4, dtype="f4") for n in XYZ}
    columns |= {n: np.array([0, 255, 51, 102], "u1") for n in ("red", "green", "blue")}
    points = write(tmp_path / "points.ply", {"vertex": columns, "face": {"a": np.arange(3, dtype="i4")}})
    cloud, full = read_splat(points), read_gaussians(points)
    assert [n.code for n in cloud.notices] == ["no_opacity"]
    assert np.array_equal(cloud.opacities, np.ones(4)) and np.allclose(cloud.colours[:, 0], [0, 1, 0.2, 0.4])
    assert full.quaternions.shape == (4, 0) and full.log_scales.shape == (4, 0)
    assert np.allclose(colour_from_sh(full.sh_dc), cloud.colours, atol=1e-6)
    assert np.array_equal(full.extra["red"], columns["red"])


def test_non_finite_gaussians_are_masked_and_keep_their_index(tmp_path, monkeypatch):
    monkeypatch.setattr(ply_columns, "BLOCK_ROWS", 7)
    columns = splat_columns(50, degree=1)
    columns["x"][3], columns["f_rest_8"][20], columns["rot_2"][49] = np.nan, np.inf, -np.inf
    for extra in ({}, {"segment": np.zeros(50, "i4")}):  # uniform rows and mixed ones
        path = write(tmp_path / "a.ply", {"vertex": columns | extra})
        cloud = read_splat(path)
        assert np.flatnonzero(~cloud.valid).tolist() == [3, 20, 49] and len(cloud) == 50
        assert cloud.notices[0].code == "non_finite_gaussians" and "3 of 50" in cloud.notices[0].message
        assert np.array_equal(cloud.centres, stacked(columns, XYZ), equal_nan=True)
        assert np.array_equal(read_gaussians(path).valid, cloud.valid)
        assert describe_splat(path).non_finite == 3 and np.isfinite(describe_splat(path).bounds).all()


def test_logits_stay_finite():
    assert np.allclose(logit_from_opacity(np.array([0, 0.5, 1.0])), [-LOGIT_LIMIT, 0, LOGIT_LIMIT])


@pytest.mark.parametrize("order", ["<", ">", "a"])
def test_truncated_file_is_said_to_be_truncated(tmp_path, order):
    data = ply_bytes({"vertex": splat_columns(30)}, order)
    start = data.index(b"end_header\n") + 11
    for size in [start, start + 1, (start + len(data)) // 2, len(data) - (40 if order == "a" else 1)]:
        (tmp_path / "cut.ply").write_bytes(data[:size])
        with pytest.raises(InputError, match="truncated" if order == "a" else "truncated, its header declares"):
            read_splat(tmp_path / "cut.ply")
    for size in (0, 3, 4, 30, start - 3):
        (tmp_path / "cut.ply").write_bytes(data[:size])
        with pytest.raises(InputError):
            read_splat(tmp_path / "cut.ply")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ((b"property float z", b"property float w"), "no z"),
        ((b"property float y", b"property float x"), "'x' occurs twice"),
        ((b"property float y", b"property list uchar float y"), "list properties"),
        ((b"element vertex 30", b"element vertex 0 "), "no vertices"),
        ((b"element vertex 30", b"element vertex 99999999999999"), "truncated"),
        ((b"element vertex 30", b"element vertex -4"), "not understood"),
        ((b"element vertex", b"element verteks"), "no vertices"),
        ((b"property float y", b"property flaot y"), "not understood"),
        ((b"binary_little_endian", b"binary_middle_endian"), "unknown PLY format"),
        ((b"ply\n", b"obj\n"), "not a PLY"),
        ((b"end_header", b"and_header"), "does not end"),
        ((b"opacity", b"f_rest_0"), "1 f_rest"),
    ],
)
def test_damaged_headers(tmp_path, change, message):
    data = ply_bytes({"vertex": splat_columns(30)})
    assert change[0] in data
    (tmp_path / "a.ply").write_bytes(data.replace(change[0], change[1], 1))
    with pytest.raises(InputError, match=message):
        read_gaussians(tmp_path / "a.ply")


def test_any_damage_to_the_header_gives_a_result_or_an_input_error(tmp_path):
    rng, data = np.random.default_rng(0), ply_bytes({"vertex": splat_columns(12)}, comments=["made for a test"])
    end, path = data.index(b"end_header") + 12, tmp_path / "a.ply"
    refused = 0
    for _ in range(300):
        damaged = bytearray(data)
        for place in rng.integers(0, end, rng.integers(1, 4)):
            damaged[place] = rng.integers(0, 256)
        path.write_bytes(damaged)
        try:
            assert len(read_splat(path)) > 0
        except InputError as error:
            assert "\n" not in str(error)
            refused += 1
    assert 100 < refused < 300


def test_missing_file_and_text_in_ascii_numbers(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        read_splat(tmp_path / "none.ply")
    data = ply_bytes({"vertex": {n: np.arange(3, dtype="f4") for n in XYZ}}, "a").replace(b"1.0 1.0", b"1.0 abc")
    (tmp_path / "a.ply").write_bytes(data)
    with pytest.raises(InputError, match="damaged"):
        read_splat(tmp_path / "a.ply")
