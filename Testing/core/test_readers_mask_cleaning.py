"""Mask cleaning: opening in mm, largest component, holes, and what is said about it."""

import numpy as np
from reader_samples import blob
from scipy import ndimage

from organphys.readers.mask_cleaning import ball_offsets, boundary_of, clean_mask, largest_component, open_by_ball

ISO = np.ones(3)


def test_ball_is_measured_in_mm():
    assert len(ball_offsets(ISO, 1.0)) == 6
    assert {tuple(o) for o in ball_offsets(np.array([3.0, 1.0, 1.0]), 1.0)} == {
        (0, 1, 0),
        (0, -1, 0),
        (0, 0, 1),
        (0, 0, -1),
    }
    assert len(ball_offsets(np.array([0.5, 1, 1]), 1.0)) == 4 + 4


def test_opening_agrees_with_scipy():
    mask = np.random.default_rng(0).random((15, 16, 17)) < 0.8
    assert np.array_equal(open_by_ball(mask, ISO), ndimage.binary_opening(np.pad(mask, 2))[2:-2, 2:-2, 2:-2])
    plane = ndimage.generate_binary_structure(3, 1)
    plane[0] = plane[2] = False
    expected = ndimage.binary_opening(np.pad(mask, 2), plane)[2:-2, 2:-2, 2:-2]
    assert np.array_equal(open_by_ball(mask, np.array([3.0, 1, 1])), expected)


def test_bridge_to_another_organ_is_cut():
    mask = np.zeros((60, 30, 20), bool)
    mask[:40] = blob((40, 30, 20))
    mask[48:51, 14:17, 9:12] = True
    mask[15:50, 15, 10] = True  # one voxel thick
    cleaned, notices = clean_mask(mask, ISO)
    assert not cleaned[48:].any() and notices == ()
    kept, _ = clean_mask(mask, ISO, opening=False)
    assert kept[48:51, 14:17, 9:12].all()


def test_thin_organ_is_left_as_it_is():
    mask = np.zeros((20, 20, 10), bool)
    mask[2:18, 2:18, 5] = True
    cleaned, notices = clean_mask(mask, ISO)
    assert np.array_equal(cleaned, mask)
    assert [n.code for n in notices] == ["opening_skipped"]
    # in-plane only where slices are thick: nothing but the four corners would go
    assert clean_mask(mask, np.array([1.0, 1.0, 3.0]))[1] == ()


def test_opening_that_splits_the_organ_is_skipped():
    mask = np.zeros((44, 20, 20), bool)
    mask[2:20, 2:18, 2:18] = mask[24:42, 2:18, 2:18] = True
    mask[20:24, 9, 9] = True  # opening removes only this, but then half of the organ would go
    cleaned, notices = clean_mask(mask, ISO)
    assert np.array_equal(cleaned, mask) and [n.code for n in notices] == ["opening_skipped"]


def test_second_piece_is_dropped_and_said():
    mask = np.zeros((60, 30, 20), bool)
    mask[:30] = blob((30, 30, 20))
    mask[35:50, 5:20, 5:15] = True
    cleaned, notices = clean_mask(mask, ISO, opening=False)
    assert np.array_equal(cleaned, largest_component(mask)) and cleaned.sum() < mask.sum()
    assert [n.code for n in notices] == ["pieces_dropped"]


def test_holes_are_closed_on_request():
    mask = blob()
    mask[12, 15, 10] = False
    assert not clean_mask(mask, ISO)[0][12, 15, 10]
    assert clean_mask(mask, ISO, close_holes=True)[0][12, 15, 10]


def test_boundary_are_voxels_with_a_face_outside():
    mask = np.zeros((6, 6, 6), bool)
    mask[1:5, 1:5, 0:4] = True
    inner = np.zeros_like(mask)
    inner[2:4, 2:4, 1:3] = True
    assert np.array_equal(boundary_of(mask), mask & ~inner)
