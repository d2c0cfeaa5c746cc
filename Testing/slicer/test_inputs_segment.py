"""A segment as voxels: the same organ as read from the file, wherever the segmentation node stands."""

from __future__ import annotations

import numpy as np
import pytest
import slicer
import vtk
from scipy.spatial import cKDTree
from vtkmodules.util.numpy_support import vtk_to_numpy

from organphys import InputError, read_organ
from organphys.exports.sample_files import write_label_map
from organphys.ground.frames import rotation_about
from organphys.readers.organ_from_mask import organ_from_mask
from OrganPhysRegistrationLib.inputs.matrices import apply_matrix, matrix_of
from OrganPhysRegistrationLib.inputs.organ_surface import organ_surface
from OrganPhysRegistrationLib.inputs.segment_input import segment_mask

LIVER, GALLBLADDER = "Segment_5", "Segment_4"


@pytest.fixture
def segmentation(scene, sample_case):
    """The sample case's label map: two organs that share one oblique label map with flipped axes."""
    return slicer.util.loadSegmentation(str(sample_case.labels))


def world_points(found):
    return apply_matrix(found.ijk_to_ras, np.argwhere(found.mask)[:, ::-1])


def under_transform(node, matrix):
    transform = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLLinearTransformNode")
    transform.SetMatrixTransformToParent(matrix_of(matrix))
    node.SetAndObserveTransformNodeID(transform.GetID())
    return transform


@pytest.mark.parametrize(("segment", "label"), [(LIVER, 5), (GALLBLADDER, 4)])
def test_organ_equals_the_one_read_from_the_file(segmentation, sample_case, segment, label):
    found = segment_mask(segmentation, segment)
    organ, expected = (
        organ_from_mask(found.mask, found.ijk_to_ras, name=found.name),
        read_organ(sample_case.labels, organ=label),
    )
    np.testing.assert_allclose(organ.vertices, expected.vertices, atol=1e-6)
    np.testing.assert_array_equal(organ.faces, expected.faces)
    np.testing.assert_allclose(organ.volume_points, expected.volume_points, atol=1e-6)
    assert organ.notices == expected.notices


def test_linear_parents_of_any_depth_are_honoured(segmentation):
    plain = world_points(segment_mask(segmentation, LIVER))
    inner, outer = np.eye(4), np.eye(4)
    inner[:3, :3], inner[:3, 3] = 1.1 * rotation_about(np.array([1.0, 2.0, 3.0]), 0.7), [5, -7, 9]
    outer[:3, :3] = np.diag([1.0, 0.8, 1.2]) @ rotation_about(np.array([0.0, 1.0, 1.0]), -0.4)  # shears the voxels
    under_transform(under_transform(segmentation, inner), outer)
    np.testing.assert_allclose(
        world_points(segment_mask(segmentation, LIVER)), apply_matrix(outer @ inner, plain), atol=1e-9
    )


def test_a_non_linear_parent_moves_the_voxels_and_leaves_the_node(segmentation, scene_contents):
    plain = world_points(segment_mask(segmentation, LIVER))
    rng, spline = np.random.default_rng(0), vtk.vtkThinPlateSplineTransform()
    source, target = vtk.vtkPoints(), vtk.vtkPoints()
    for point in plain[rng.integers(0, len(plain), 8)]:
        source.InsertNextPoint(point)
        target.InsertNextPoint(point + rng.normal(0, 6, 3) + [0, 0, 300])
    spline.SetSourceLandmarks(source)
    spline.SetTargetLandmarks(target)
    spline.SetBasisToR()
    transform = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLTransformNode")
    transform.SetAndObserveTransformToParent(spline)
    segmentation.SetAndObserveTransformNodeID(transform.GetID())
    before = scene_contents()
    moved = world_points(segment_mask(segmentation, LIVER))
    expected = np.array([spline.TransformPoint(point) for point in plain[::5]])
    voxel = 4.0
    assert cKDTree(moved).query(expected)[0].max() < 0.9 * voxel  # half a voxel's diagonal
    back = np.array([spline.GetInverse().TransformPoint(point) for point in moved[::5]])
    assert cKDTree(plain).query(back)[0].max() < 0.9 * voxel
    assert scene_contents() == before
    segmentation.SetAndObserveTransformNodeID(None)
    np.testing.assert_allclose(world_points(segment_mask(segmentation, LIVER)), plain)


def test_closed_surface_alone_is_filled_on_a_copy(segmentation):
    plain = world_points(segment_mask(segmentation, LIVER))
    segmentation.CreateClosedSurfaceRepresentation()
    content = segmentation.GetSegmentation()
    content.SetSourceRepresentationName("Closed surface")
    content.RemoveRepresentation("Binary labelmap")
    filled = world_points(segment_mask(segmentation, LIVER))
    assert len(filled) == pytest.approx(len(plain), rel=0.02)
    np.testing.assert_allclose(filled.mean(0), plain.mean(0), atol=0.5)
    assert content.GetSegment(LIVER).GetRepresentation("Binary labelmap") is None


@pytest.mark.parametrize("cut", [False, True])
def test_border_notice_speaks_of_the_volume_not_of_the_label_map(scene, tmp_path, cut):
    labels = np.zeros((24, 20, 16), dtype=np.uint8)
    labels[8:18, 6:15, (0 if cut else 3) : 12] = 1
    affine = np.diag([3.0, 3.0, 3.0, 1.0])
    write_label_map(tmp_path / "block.nrrd", labels, affine)
    segmentation = slicer.util.loadSegmentation(str(tmp_path / "block.nrrd"))
    segmentation.GetSegmentation().CollapseBinaryLabelmaps()  # crops the label map to what is painted
    found = segment_mask(segmentation, segmentation.GetSegmentation().GetNthSegmentID(0))
    organ = organ_from_mask(found.mask, found.ijk_to_ras, name="block")
    assert ("organ_cut_by_border" in [notice.code for notice in organ.notices]) == cut
    np.testing.assert_allclose(world_points(found).min(0), [24, 18, 0 if cut else 9], atol=1e-6)


def test_paint_outside_of_the_reference_volume_is_kept(scene):
    image = slicer.vtkOrientedImageData()
    image.SetExtent(-3, 6, 0, 5, 0, 5)
    image.AllocateScalars(vtk.VTK_UNSIGNED_CHAR, 1)
    image.GetPointData().GetScalars().Fill(1)
    segmentation = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLSegmentationNode")
    name = slicer.vtkSegmentationConverter.GetReferenceImageGeometryParameterName()
    geometry = "1;0;0;0;0;1;0;0;0;0;1;0;0;0;0;1;0;9;0;9;0;9;"
    segmentation.GetSegmentation().SetConversionParameter(name, geometry)
    segment_id = segmentation.AddSegmentFromBinaryLabelmapRepresentation(image, "painted")
    points = world_points(segment_mask(segmentation, segment_id))
    assert len(points) == 10 * 6 * 6
    np.testing.assert_allclose([points.min(0), points.max(0)], [[-3, 0, 0], [6, 5, 5]], atol=1e-9)


def test_surface_follows_the_parents(segmentation):
    plain = vtk_to_numpy(organ_surface(segmentation, LIVER).GetPoints().GetData())
    shift = np.eye(4)
    shift[:3, 3] = [10, 20, 30]
    transform = under_transform(segmentation, shift)
    moved = vtk_to_numpy(organ_surface(segmentation, LIVER).GetPoints().GetData())
    np.testing.assert_allclose(moved, plain + shift[:3, 3], atol=1e-3)
    assert segmentation.GetParentTransformNode() is transform
    assert segmentation.GetSegmentation().GetSegment(LIVER).GetRepresentation("Closed surface") is None


def test_surface_is_made_anew_after_editing(segmentation):
    before = organ_surface(segmentation, LIVER).GetBounds()
    image = segmentation.GetSegmentation().GetSegment(LIVER).GetRepresentation("Binary labelmap")
    voxels = vtk_to_numpy(image.GetPointData().GetScalars())
    occupied = np.flatnonzero(voxels == 5)
    voxels[occupied[: len(occupied) // 2]] = 0
    image.Modified()
    after = organ_surface(segmentation, LIVER).GetBounds()
    assert np.abs(np.subtract(after, before)).max() > 20  # mm
    assert organ_surface(segmentation, GALLBLADDER).GetBounds() != after


def test_bad_input_says_what_to_do(segmentation, sample_case):
    empty = segmentation.GetSegmentation().AddEmptySegment("", "Tumour")
    for node, segment, message in [
        (None, LIVER, "choose the segmentation"),
        (segmentation, "", "choose the organ's segment"),
        (segmentation, "Segment_99", "choose the organ again"),
        (segmentation, empty, "Tumour: it is empty"),
        (slicer.mrmlScene.AddNewNodeByClass("vtkMRMLModelNode", "mesh"), LIVER, "mesh is no segmentation"),
    ]:
        for function in (segment_mask, organ_surface):
            with pytest.raises(InputError) as caught:
                function(node, segment)
            if function is segment_mask:
                assert message in str(caught.value)
            assert "\n" not in str(caught.value)
