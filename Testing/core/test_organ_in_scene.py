"""A cluttered scene: divided into pieces of one tissue, and the organ found among them."""

import numpy as np
import pytest
from scene_examples import bumpy_organ, seen_from_camera

from organphys.pipeline import organ_in_scene as module
from organphys.pipeline.case import Case
from organphys.pipeline.organ_in_scene import organ_in_scene
from organphys.points.point_sets import GaussianCloud
from organphys.points.scene_segments import chromaticity, scene_segments

RED, YELLOW = (0.7, 0.25, 0.2), (0.6, 0.5, 0.25)


def plate(*, depth, low, high, count=4000, seed=0):
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(low, high, (count, 2)).T
    return np.column_stack([x, y, np.full(count, depth)])


def shaded(colour, count, seed=0):
    """The colour at brightnesses of 40 to 100 %, a little noisy."""
    rng = np.random.default_rng(seed)
    return np.outer(rng.uniform(0.4, 1.0, count), colour) + rng.normal(0, 0.01, (count, 3))


def cloud_of(points, colours):
    return GaussianCloud(points, np.full(len(points), 0.9), colours, np.ones(len(points), dtype=bool))


def test_chromaticity_does_not_know_brightness():
    bright, dark = chromaticity(np.array([[0.8, 0.4, 0.2], [0.4, 0.2, 0.1]]))
    np.testing.assert_allclose(bright, dark, atol=0.03)
    assert np.abs(chromaticity(np.array([YELLOW])) - bright).max() > 0.1


def test_segments_by_colour_on_one_plane():
    points = plate(depth=4.0, low=(-1, -1), high=(1, 1))
    left = points[:, 0] < -0.2
    colours = np.where(left[:, None], shaded(RED, len(points)), shaded(YELLOW, len(points)))
    segments = scene_segments(points, colours, np.zeros(3))
    assert len(segments) == 2
    assert (segments[0] == ~left).mean() > 0.97 and (segments[1] == left).mean() > 0.97


def test_a_scene_of_one_piece_is_one_segment_of_all_points():
    points = np.random.default_rng(3).uniform(-1, 1, (5000, 3)) * [1, 1, 0.01] + [0, 0, 5]
    points[:20] += [0, 0, 3]  # too few for a piece of their own
    segments = scene_segments(points, shaded(RED, len(points)), np.zeros(3))
    assert len(segments) == 1 and segments[0].all()


def test_segments_by_depth_of_one_colour_and_their_union():
    near = plate(depth=3.0, low=(-1, -1), high=(0, 1))
    far = plate(depth=5.0, low=(0, -1.6), high=(1.6, 1.6), seed=1)
    points = np.vstack([near, far])
    segments = scene_segments(points, shaded(RED, len(points)), np.zeros(3))
    assert [round(s.mean(), 1) for s in segments] == [0.5, 0.5, 1.0]
    assert segments[0][:4000].mean() in (0.0, 1.0)


def test_a_splat_of_one_piece_stays_as_it_is(monkeypatch):
    monkeypatch.setattr(module, "_score", lambda method: pytest.fail("nothing was to be tried"))
    cloud = seen_from_camera(bumpy_organ()).cloud
    case = Case.of(bumpy_organ(), cloud)
    assert organ_in_scene(case) is case


@pytest.fixture(scope="module")
def cluttered():
    """The organ, red, before a yellow wall and beside a yellow block."""
    organ = bumpy_organ()
    seen = seen_from_camera(organ).points
    wall = plate(depth=8.5, low=(-6, -6), high=(6, 6), count=9000)
    block = plate(depth=4.5, low=(-4.5, -1), high=(-2.5, 2), count=3000, seed=2)
    direction = wall[:, :2] / wall[:, 2:]
    hidden = np.linalg.norm(direction - np.median(seen[:, :2] / seen[:, 2:], axis=0), axis=1) < 0.25
    rest = np.vstack([wall[~hidden], block])
    colours = np.vstack([shaded(RED, len(seen)), shaded(YELLOW, len(rest))])
    return organ, cloud_of(np.vstack([seen, rest]), colours), len(seen)


def test_organ_is_found_in_a_cluttered_scene(cluttered):
    organ, cloud, count = cluttered
    case = organ_in_scene(Case.of(organ, cloud))
    members = np.isin(np.arange(len(cloud)), case.scene.rows)
    assert members[:count].mean() > 0.95 and members[count:].mean() < 0.02
    assert len(case.scene.others) == len(cloud) - members.sum()
    np.testing.assert_array_equal(case.scene.centres, cloud.centres[case.scene.rows])
    assert [n.code for n in case.notices if n.code.startswith("organ_")] == ["organ_found_in_scene"]


def test_a_scene_in_which_nothing_fits_well_is_told(cluttered, monkeypatch):
    organ, cloud, _ = cluttered
    scores = iter([1.2, 0.9, 0.85, 1.0, 1.1, 1.0, 1.0])
    monkeypatch.setattr(module, "_score", lambda method: next(scores))
    monkeypatch.setattr(module, "_same_organ", lambda method, case: method)
    notices = organ_in_scene(Case.of(organ, cloud)).notices
    told = next(n.message for n in notices if n.code == "organ_in_scene_unsure")
    assert "0.85" in told and "0.90" in told and "crop box" in told
