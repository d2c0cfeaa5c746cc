"""Pictures by VTK off the screen show what the software renderer shows, at the same pixels."""

import numpy as np
import pytest
from simulation_examples import box_surface

pytest.importorskip("vtkmodules.vtkRenderingOpenGL2", reason="this VTK cannot draw", exc_type=ImportError)

from organphys.exports.simulation_pictures import stages
from organphys.exports.vtk_pictures import VtkStage
from organphys.ground.checks import InputError

SIZE = np.array([1.0, 0.4, 0.4])
GREEN = np.array([0.0, 1.0, 0.0])


@pytest.fixture(scope="module")
def pair():
    """The same stage by software and by VTK: a box before the camera, green Gaussians on half of its front."""
    vertices, faces = box_surface(SIZE, 0.1)
    vertices = vertices - SIZE / 2 + [0, 0, 2.0]
    x, y = (k.ravel() for k in np.meshgrid(np.linspace(0.02, 0.48, 60), np.linspace(-0.18, 0.18, 50)))
    centres = np.column_stack([x, y, np.full(len(x), 1.79)])
    colours = np.tile(GREEN, (len(x), 1))
    stage = stages(vertices, faces, vertices, camera=np.zeros(3), centres=centres, colours=colours)[0]
    try:
        return stage, VtkStage(stage), vertices, centres
    except InputError as error:
        pytest.skip(str(error))


def test_both_renderers_put_organ_splat_and_tool_at_the_same_pixels(pair):
    stage, by_vtk, vertices, centres = pair
    tool = box_surface(np.array([0.1, 0.1, 0.1]), 0.05)
    tools = [(tool[0] + [-0.4, -0.05, 1.5], tool[1])]
    ours, theirs = (one.picture(vertices, centres, tools).astype(float) for one in (stage, by_vtk))
    assert ours.shape == theirs.shape
    background = np.abs(ours - ours[0, 0]).max(2) < 3
    assert (background == (np.abs(theirs - theirs[0, 0]).max(2) < 3)).mean() > 0.98
    green = [image[..., 1] > image[..., 0] + 60 for image in (ours, theirs)]
    assert green[0].sum() > 2000 and (green[0] & green[1]).sum() > 0.95 * (green[0] | green[1]).sum()
    grey = [(np.ptp(image, axis=2) < 25) & (image.min(2) > 60) for image in (ours, theirs)]
    assert grey[0].sum() > 200 and (grey[0] & grey[1]).sum() > 0.85 * (grey[0] | grey[1]).sum()


def test_a_tool_behind_tissue_shines_through_and_moved_tissue_is_drawn_where_it_is(pair):
    _, by_vtk, vertices, _ = pair
    tool = box_surface(np.array([0.1, 0.1, 0.1]), 0.05)
    nothing = np.zeros((0, 3))
    alone = by_vtk.picture(vertices, nothing, []).astype(float)
    behind = by_vtk.picture(vertices, nothing, [(tool[0] + [-0.05, -0.05, 2.5], tool[1])]).astype(float)
    changed = np.abs(behind - alone).max(2)
    assert 5 < changed.max() < 90 and (changed > 5).sum() > 100
    moved = by_vtk.picture(vertices + np.array([0.2, 0, 0]), nothing, []).astype(float)
    assert (np.abs(moved - alone).max(2) > 30).sum() > 1000


def test_without_opengl_the_user_is_told_what_to_do(pair, monkeypatch):
    from vtkmodules import vtkRenderingCore

    class Blind:
        def SupportsOpenGL(self):
            return 0

    monkeypatch.setattr(vtkRenderingCore, "vtkRenderWindow", Blind)
    with pytest.raises(InputError, match="use the software renderer"):
        VtkStage(pair[0])
