"""The sample case: made once, loaded from the cache folder, offered in the Sample Data module."""

from __future__ import annotations

import numpy as np
import pytest
import SampleData
import slicer

from organphys import InputError, read_landmarks
from OrganPhysRegistrationLib.inputs import sample_case as sample
from OrganPhysRegistrationLib.inputs.landmark_input import landmark_messages, landmark_points, organ_surface
from OrganPhysRegistrationLib.inputs.segment_input import segment_mask
from OrganPhysRegistrationLib.inputs.splat_node import is_splat


def test_made_once_then_read_again(scene, tmp_path):
    said = []
    case = sample.load_sample_case(folder=tmp_path / "case", size="small", on_status=said.append)
    assert "being made" in said[0] and said[-1] == ""
    assert case.segmentation.GetSegmentation().GetSegment(case.segment_id).GetName() == "liver"
    assert segment_mask(case.segmentation, case.segment_id).name == "liver"
    assert is_splat(case.splat)
    expected = read_landmarks(tmp_path / "case" / "landmarks.mrk.json")
    positions, names = landmark_points(case.landmarks)
    np.testing.assert_allclose(positions, expected.positions)
    assert tuple(names) == expected.names
    assert landmark_messages(case.landmarks, organ_surface(case.segmentation, case.segment_id)) == []
    made = (tmp_path / "case" / "splat.ply").stat().st_mtime_ns
    said.clear()
    sample.load_sample_case(folder=tmp_path / "case", size="small", on_status=said.append)
    assert (tmp_path / "case" / "splat.ply").stat().st_mtime_ns == made
    assert not any("being made" in text for text in said)


def test_default_folder_is_in_slicers_cache(scene):
    assert str(sample.sample_folder()).startswith(slicer.mrmlScene.GetCacheManager().GetRemoteCacheDirectory())


@pytest.fixture
def no_sources(monkeypatch):
    monkeypatch.setattr(SampleData.SampleDataLogic, "sources", [])


def test_offered_in_the_sample_data_module(scene, no_sources, tmp_path):
    sample.register_sample_case(lambda: sample.load_sample_case(folder=tmp_path / "case", size="small"))
    segmentation, splat, landmarks = SampleData.downloadSample(sample.NAME)
    assert segmentation.IsA("vtkMRMLSegmentationNode") and is_splat(splat)
    assert landmarks.GetNumberOfControlPoints() == 2


def test_a_failure_is_told(scene, no_sources, caplog):
    def fails():
        raise InputError("no room on the disk; free some")

    sample.register_sample_case(fails)
    assert SampleData.downloadSample(sample.NAME) == []
    assert "free some" in caplog.text
