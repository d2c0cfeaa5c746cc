"""An organ from a mask in memory is the organ of the same voxels on disk, for any affine."""

import numpy as np
import pytest
from reader_samples import blob, write_labels
from scipy.spatial.transform import Rotation

from organphys.ground.checks import InputError
from organphys.readers.mask_surface import signed_volume
from organphys.readers.organ_from_mask import organ_from_mask
from organphys.readers.segmentation_file import read_organ

SPACING = (1.2, 0.8, 2.0)


def affine_of(*, shear=0.0, mirrored=False):
    """Oblique affine (4, 4) from ijk to RAS mm."""
    step = Rotation.from_rotvec([0.3, -0.5, 0.2]).as_matrix() * np.array(SPACING)
    step[:, 0] *= -1 if mirrored else 1
    affine = np.eye(4)
    affine[:3, :3] = step @ np.array([[1, 0, shear], [0, 1, 0], [0, 0, 1]])
    affine[:3, 3] = [10, -200, 55]
    return affine


@pytest.mark.parametrize("mirrored", [False, True])
def test_same_organ_as_from_a_file(tmp_path, mirrored):
    mask, affine = blob(spacing=SPACING), affine_of(mirrored=mirrored)
    from_file = read_organ(write_labels(tmp_path / "a.nrrd", mask.astype(np.uint8), affine=affine), organ=1)
    organ = organ_from_mask(mask.transpose(2, 1, 0), affine, name="label 1")
    for name in ("vertices", "vertex_normals", "volume_points", "spacing_mm"):
        np.testing.assert_allclose(getattr(organ, name), getattr(from_file, name), atol=1e-6, err_msg=name)
    np.testing.assert_array_equal(organ.faces, from_file.faces)
    np.testing.assert_array_equal(organ.boundary, from_file.boundary)
    assert organ.volume_ml == pytest.approx(from_file.volume_ml, rel=1e-9)
    assert (organ.name, organ.notices) == (from_file.name, from_file.notices)


@pytest.mark.parametrize("mirrored", [False, True])
def test_sheared_voxels_keep_place_volume_and_outside(mirrored):
    mask, affine = blob(spacing=SPACING), affine_of(shear=0.5, mirrored=mirrored)
    organ = organ_from_mask(mask.transpose(2, 1, 0), affine, opening=False)
    expected = np.argwhere(mask) @ affine[:3, :3].T + affine[:3, 3]
    assert organ.volume_ml == pytest.approx(mask.sum() * np.prod(SPACING) / 1000, rel=1e-9)  # shear keeps volume
    np.testing.assert_allclose(np.sort(organ.volume_points, axis=0), np.sort(expected, axis=0), atol=1e-9)
    assert signed_volume(organ.vertices, organ.faces) / 1000 == pytest.approx(organ.volume_ml, rel=0.05)
    outward = np.einsum("ni,ni->n", organ.vertex_normals, organ.vertices - organ.vertices.mean(0))
    assert outward.mean() > 3


def test_border_holes_and_numbers_for_a_mask():
    mask = np.zeros((20, 20, 20), dtype=np.uint8)
    mask[:12, 4:16, 4:16] = 1
    mask[6, 9:11, 9:11] = 0
    progress = []
    organ = organ_from_mask(
        mask,
        np.eye(4),
        name="cube",
        opening=False,
        close_holes=True,
        progress=lambda stage, part: progress.append((stage, part)),
    )
    assert [notice.code for notice in organ.notices] == ["organ_cut_by_border"]
    assert "cube" in organ.notices[0].message
    assert organ.volume_ml == pytest.approx(12**3 / 1000)
    assert progress[0] == ("read", 0.0) and progress[-1] == ("read", 1.0)
    assert organ_from_mask(np.roll(mask, 3, axis=0), np.eye(4), opening=False).notices == ()


@pytest.mark.parametrize(
    ("mask", "affine", "message"),
    [
        (np.zeros((5, 5, 5), bool), np.eye(4), "empty"),
        (np.ones((5, 5), bool), np.eye(4), "shape"),
        (np.ones((5, 5, 5), bool), np.eye(3), "affine"),
        (np.ones((5, 5, 5), bool), "x", "affine"),
        (np.ones((5, 5, 5), bool), np.diag([1.0, 1, 0, 1]), "span a volume"),
        (np.ones((5, 5, 5), bool), np.diag([1.0, 1, np.nan, 1]), "finite"),
    ],
)
def test_unusable_masks_are_refused(mask, affine, message):
    with pytest.raises(InputError, match=message):
        organ_from_mask(mask, affine)
