"""Label maps: the same organ from any grid and format, outward surfaces, honest errors."""

import subprocess
import sys
from itertools import permutations
from pathlib import Path

import numpy as np
import pytest
from reader_samples import blob, write_labels
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from organphys.ground.checks import InputError
from organphys.readers import label_volume
from organphys.readers.mask_surface import signed_volume
from organphys.readers.segmentation_file import describe_segmentation, read_organ

SPACING = (1.2, 0.8, 2.0)
SHARED = Path(__file__).resolve().parents[2].parent / "shared"


def oblique_affine(spacing=SPACING) -> np.ndarray:
    affine = np.eye(4)
    affine[:3, :3] = Rotation.from_rotvec([0.3, -0.5, 0.2]).as_matrix() * np.array(spacing)
    affine[:3, 3] = [10, -200, 55]
    return affine


def regrid(mask, affine, order, flips):
    """The same voxels with permuted and reversed axes."""
    matrix = np.zeros((4, 4))
    matrix[3, 3] = 1
    for new, old in enumerate(order):
        matrix[old, new] = -1 if flips[new] else 1
        matrix[old, 3] += mask.shape[old] - 1 if flips[new] else 0
    moved = mask.transpose(order)
    return moved[tuple(slice(None, None, -1) if f else slice(None) for f in flips)], affine @ matrix


def sorted_rows(points):
    rounded = np.round(points, 3)
    return rounded[np.lexsort(rounded.T)]


@pytest.mark.parametrize("suffix", [".nii.gz", ".nrrd", ".mha"])
def test_any_axis_order_gives_the_same_organ(tmp_path, suffix):
    mask, affine = blob(spacing=SPACING), oblique_affine()
    expected = np.argwhere(mask) @ affine[:3, :3].T + affine[:3, 3]
    reference = read_organ(
        write_labels(tmp_path / f"a{suffix}", mask.astype(np.uint8), affine=affine), organ=1, opening=False
    )
    assert np.allclose(sorted_rows(reference.volume_points), sorted_rows(expected), atol=2e-3)
    cases = [
        (order, flips) for order in permutations(range(3)) for flips in ((0, 0, 0), (1, 0, 0), (0, 1, 1), (1, 1, 1))
    ]
    for order, flips in cases[:: 1 if suffix == ".nrrd" else 5]:
        labels, turned = regrid(mask.astype(np.uint8), affine, order, flips)
        organ = read_organ(write_labels(tmp_path / f"b{suffix}", labels, affine=turned), organ=1, opening=False)
        assert np.allclose(sorted_rows(organ.volume_points), sorted_rows(expected), atol=2e-3)
        assert np.allclose(sorted_rows(organ.boundary_points), sorted_rows(reference.boundary_points), atol=2e-3)
        enclosed = signed_volume(organ.vertices, organ.faces)
        assert enclosed == pytest.approx(signed_volume(reference.vertices, reference.faces), rel=1e-3)
        assert cKDTree(reference.vertices).query(organ.vertices)[0].max() < 1e-3
        centre = organ.volume_points.mean(0)
        assert np.einsum("ni,ni->n", organ.vertex_normals, organ.vertices - centre).mean() > 3
        assert len(organ.vertices) == len(reference.vertices)
        assert organ.volume_ml == pytest.approx(mask.sum() * np.prod(SPACING) / 1000, rel=1e-5)


def test_surface_of_a_ball_has_its_radius_and_radial_normals(tmp_path):
    grid = np.indices((40, 40, 40)) - 19.3
    labels = ((grid**2).sum(0) < 12.0**2).astype(np.int16) * 7
    organ = read_organ(write_labels(tmp_path / "ball.nii", labels), organ="7")
    radial = organ.vertices - 19.3
    radius = np.linalg.norm(radial, axis=1)
    assert radius.mean() == pytest.approx(12.0, abs=0.15)  # boundary-voxel centres would give 11.5
    assert radius.std() < 0.3
    cosine = np.einsum("ni,ni->n", organ.vertex_normals, radial / radius[:, None])
    assert cosine.min() > 0.96
    assert np.allclose(np.linalg.norm(organ.vertex_normals, axis=1), 1)
    edges = np.sort(np.concatenate([organ.faces[:, [0, 1]], organ.faces[:, [1, 2]], organ.faces[:, [2, 0]]]), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()  # closed
    assert signed_volume(organ.vertices, organ.faces) == pytest.approx(1000 * organ.volume_ml, rel=0.02)
    assert organ.name == "label 7" and organ.notices == ()


def test_big_masks_are_thinned_and_keep_their_volume(tmp_path, monkeypatch):
    path = write_labels(tmp_path / "a.nrrd", blob((60, 70, 50)).astype(np.uint8))
    fine = read_organ(path, organ=1)
    monkeypatch.setattr("organphys.readers.mask_surface.MAX_CELLS", 20_000)
    coarse = read_organ(path, organ=1)
    assert len(coarse.vertices) < 0.5 * len(fine.vertices)
    volume = signed_volume(fine.vertices, fine.faces)
    assert signed_volume(coarse.vertices, coarse.faces) == pytest.approx(volume, rel=0.01)
    assert np.allclose(coarse.vertices.mean(0), fine.vertices.mean(0), atol=0.15)


def test_reading_in_slabs_changes_nothing(tmp_path, monkeypatch):
    labels = blob().astype(np.int16) * 3
    labels[2:4, 2:4, 2:4] = 9
    path = write_labels(tmp_path / "a.nii.gz", labels)
    whole, info = read_organ(path, organ=3), describe_segmentation(path)
    monkeypatch.setattr(label_volume, "STREAM_ABOVE_BYTES", 6000)
    monkeypatch.setattr(label_volume, "SLAB_VOXELS", 1500)
    slabwise = read_organ(path, organ=3)
    assert np.array_equal(whole.volume_points, slabwise.volume_points)
    assert np.array_equal(whole.vertices, slabwise.vertices)
    assert describe_segmentation(path) == info
    assert [(c.label, c.voxels) for c in info.labels] == [(3, int((labels == 3).sum())), (9, 8)]


def test_border_tiny_and_missing_organs(tmp_path):
    labels = np.zeros((20, 20, 20), np.uint8)
    labels[0:8, 5:12, 5:12] = 1
    labels[15, 15, 15] = 2
    labels[10:13, 15:17, 2:4] = 3
    path = write_labels(tmp_path / "a.nrrd", labels)
    assert "organ_cut_by_border" in [n.code for n in read_organ(path, organ=1).notices]
    with pytest.raises(InputError, match="too few for a surface"):
        read_organ(path, organ=2)
    small = read_organ(path, organ=3)
    assert len(small.volume_points) == 12 and signed_volume(small.vertices, small.faces) > 0
    with pytest.raises(InputError, match=r"label 4.*present: 1 \(0.4 ml\), 2 \(0.0 ml\), 3"):
        read_organ(path, organ=4)
    for absent in (300, "9" * 30):  # beyond the pixel type
        with pytest.raises(InputError, match="is not in the map"):
            read_organ(path, organ=absent)
    for wrong in (0, -3, "0"):
        with pytest.raises(InputError, match="above 0"):
            read_organ(path, organ=wrong)


@pytest.mark.parametrize("suffix", [".nii", ".nii.gz", ".nrrd", ".mha"])
def test_truncated_files_are_input_errors(tmp_path, suffix):
    data = write_labels(tmp_path / f"a{suffix}", blob().astype(np.int16)).read_bytes()
    cut = tmp_path / f"cut{suffix}"
    for size in (0, 3, 90, 200, 352, len(data) // 2, len(data) - 40):
        cut.write_bytes(data[:size])
        with pytest.raises(InputError):
            read_organ(cut, organ=1)


def test_header_that_promises_too_much_is_refused_before_allocation(tmp_path):
    data = bytearray(write_labels(tmp_path / "a.nii", blob().astype(np.int16)).read_bytes())
    for sizes in ((32000, 32000, 32000), (1500, 1500, 1500)):
        data[42:48] = np.array(sizes, "<i2").tobytes()
        (tmp_path / "b.nii").write_bytes(data)
        with pytest.raises(InputError, match="declare"):
            read_organ(tmp_path / "b.nii", organ=1)


def test_files_that_are_no_label_maps(tmp_path):
    (tmp_path / "series").mkdir()
    (tmp_path / "seg.dcm").write_bytes(b"\0" * 128 + b"DICM")
    (tmp_path / "nosuffix").write_bytes(b"\0" * 128 + b"DICM")
    for name in ("series", "seg.dcm", "nosuffix"):
        with pytest.raises(InputError, match=r"save .* as \.seg\.nrrd"):
            read_organ(tmp_path / name, organ=1)
    with pytest.raises(InputError, match="no such file"):
        read_organ(tmp_path / "none.nii.gz", organ=1)
    (tmp_path / "a.txt").write_text("x")
    with pytest.raises(InputError, match="unknown kind"):
        read_organ(tmp_path / "a.txt", organ=1)
    image = write_labels(tmp_path / "ct.nrrd", np.random.default_rng(0).normal(size=(9, 9, 9)).astype(np.float32))
    for organ in ("liver", 5):
        with pytest.raises(InputError, match="give its label map"):
            read_organ(image, organ=organ)
    whole_numbers = write_labels(tmp_path / "f.nrrd", blob().astype(np.float32) * 5)
    assert read_organ(whole_numbers, organ=5).volume_ml == pytest.approx(blob().sum() / 1000, rel=0.05)


def test_reading_loads_no_rendering_and_importing_no_vtk(tmp_path):
    path = write_labels(tmp_path / "a.nrrd", blob().astype(np.uint8))
    code = (
        "import sys; from organphys.readers.segmentation_file import read_organ;"
        "assert not any(m.startswith(('vtk', 'SimpleITK', 'torch')) for m in sys.modules);"
        f"read_organ({str(path)!r}, organ=1);"
        "assert 'vtkmodules.vtkFiltersCore' in sys.modules;"
        "assert not any('Rendering' in m for m in sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.skipif(not SHARED.is_dir(), reason="no case data beside the repository")
def test_case_liver_has_its_stated_volume():
    organ = read_organ(SHARED / "cases/dev/liver_a/ct_labels.nii.gz", organ="liver", label_scheme="totalsegmentator")
    assert organ.volume_ml == pytest.approx(1953, rel=0.015)
    assert signed_volume(organ.vertices, organ.faces) / 1000 == pytest.approx(organ.volume_ml, rel=0.01)
