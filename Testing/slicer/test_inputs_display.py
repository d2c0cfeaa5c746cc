"""What of a splat is shown: threshold, crop box, floaters; the file's points and arrays stay."""

from __future__ import annotations

import numpy as np
import pytest
import slicer
from PIL import Image
from splat_files import write_gaussians
from vtkmodules.util.numpy_support import vtk_to_numpy

from organphys import Box, InputError
from organphys.points.target_selection import select_clean_target, select_target
from OrganPhysRegistrationLib.inputs.floaters import (
    PREVIEW_COLOUR,
    end_preview,
    floaters,
    preview_floaters,
    update_splat,
)
from OrganPhysRegistrationLib.inputs.splat_display import (
    set_point_size,
    show_everything,
    shown_gaussians,
)
from OrganPhysRegistrationLib.inputs.splat_node import load_splat, splat_arrays


@pytest.fixture
def splat(scene, sample_case):
    return load_splat(sample_case.splat)


@pytest.fixture
def box(splat):
    centres = splat_arrays(splat).centres.astype(float)
    return Box(np.median(centres, axis=0), np.ptp(centres, axis=0) / 3)


def test_shown_is_what_registration_takes(splat, box):
    cloud = splat_arrays(splat)
    for opacity in (0.1, 0.5):
        for crop in (None, box):
            expected = select_target(cloud, opacity=opacity, box=crop)
            assert update_splat(splat, opacity=opacity, box=crop) == expected.sum()
            np.testing.assert_array_equal(shown_gaussians(splat), expected)
    clean, report = select_clean_target(cloud, opacity=0.1, box=box)
    assert report.keep.sum() < len(report.keep)
    assert update_splat(splat, opacity=0.1, box=box, remove_floaters=True) == clean.sum()
    np.testing.assert_array_equal(shown_gaussians(splat), clean)


def test_hiding_is_not_destructive(splat, box):
    data = splat.GetPolyData().GetPointData()
    names = [data.GetArrayName(k) for k in range(data.GetNumberOfArrays())]
    before = [vtk_to_numpy(data.GetArray(name)).copy() for name in names]
    points = vtk_to_numpy(splat.GetPolyData().GetPoints().GetData()).copy()
    update_splat(splat, opacity=0.9, box=box, remove_floaters=True)
    preview_floaters(splat)
    update_splat(splat, opacity=1.0)
    assert not shown_gaussians(splat).any()
    assert show_everything(splat) == len(points)
    assert [data.GetArrayName(k) for k in range(data.GetNumberOfArrays())] == names
    for name, values in zip(names, before, strict=True):
        np.testing.assert_array_equal(vtk_to_numpy(data.GetArray(name)), values)
    np.testing.assert_array_equal(vtk_to_numpy(splat.GetPolyData().GetPoints().GetData()), points)
    assert splat.GetPolyData().GetVerts().GetNumberOfCells() == len(points)  # one each, so that clipping can cut them


def test_preview_colours_the_floaters_only(splat):
    colours = vtk_to_numpy(splat.GetPolyData().GetPointData().GetArray("colour")).copy()
    count = preview_floaters(splat)
    found = floaters(splat)
    assert count == found.sum() > 0
    display, data = splat.GetDisplayNode(), splat.GetPolyData().GetPointData()
    shown = vtk_to_numpy(data.GetArray(display.GetActiveScalarName()))
    np.testing.assert_array_equal(shown[found], np.tile(PREVIEW_COLOUR, (count, 1)))
    np.testing.assert_array_equal(shown[~found], colours[~found])
    assert shown_gaussians(splat)[found].all()
    end_preview(splat)
    assert display.GetActiveScalarName() == "colour" and data.GetNumberOfArrays() == 5


def test_floaters_are_searched_anew_when_the_choice_changes(splat, box):
    everywhere, here = floaters(splat), floaters(splat, box=box)
    assert (everywhere & ~update_and_show(splat, box)).any()
    assert not (here & ~update_and_show(splat, box)).any()


def update_and_show(splat, box):
    update_splat(splat, box=box)
    return shown_gaussians(splat)


def test_points_are_drawn_in_their_own_colours(scene, tmp_path, view_png):
    """Four blocks of points, seen from the front: red left, green right, blue above, white below."""
    rng = np.random.default_rng(0)
    blocks = {(-1, 0): (1, 0, 0), (1, 0): (0, 1, 0), (0, -1): (0, 0, 1), (0, 1): (1, 1, 1)}  # OpenCV: y is down
    centres = np.concatenate([np.array([x, y, 5]) + rng.uniform(-0.2, 0.2, (4000, 3)) for x, y in blocks])
    colours = np.repeat(list(blocks.values()), 4000, axis=0)
    opaque = np.full(len(centres), 0.9)
    path = write_gaussians(
        tmp_path / "blocks.ply", centres, opacities=opaque, log_scales=np.zeros_like(centres), colours=colours
    )
    splat = load_splat(path, mm_per_unit=50)
    set_point_size(splat, 6)
    view = slicer.app.layoutManager().threeDWidget(0).threeDView()
    view.resetFocalPoint()
    camera = view.cameraNode()
    camera.RotateTo(camera.Posterior)  # from the patient's back, where the endoscope's camera is
    picture = np.asarray(Image.open(view_png("splat_colours", fit=False)).convert("RGB")).astype(int)
    place = {}
    for name, colour in {"red": (255, 0, 0), "green": (0, 255, 0), "blue": (0, 0, 255), "white": (255,) * 3}.items():
        rows, columns = np.nonzero(np.abs(picture - colour).max(axis=2) < 8)
        assert len(rows) > 100, name
        place[name] = np.median(columns), np.median(rows)
    assert place["red"][0] < place["blue"][0] < place["green"][0]
    assert place["blue"][1] < place["red"][1] < place["white"][1]


def test_bad_point_size(splat):
    with pytest.raises(InputError, match="point size"):
        set_point_size(splat, 0)
