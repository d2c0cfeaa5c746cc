"""The file reader: splats are claimed from Slicer's model reader, other PLY files are left to it."""

from __future__ import annotations

import numpy as np
import pytest
import slicer
from splat_files import write_gaussians, write_mesh, write_points

from OrganPhysRegistrationLib.inputs.splat_node import is_splat
from OrganPhysRegistrationLib.inputs.splat_reader import HEADER_BYTES, OrganPhysRegistrationFileReader

MODELS_READER = 0.54  # Slicer's own answer for every .ply


class Parent:
    """What qSlicerScriptedFileReader offers a reader."""

    def __init__(self):
        self.loadedNodes, self.messages = [], slicer.vtkMRMLMessageCollection()

    def userMessages(self):
        return self.messages


@pytest.fixture
def reader():
    return OrganPhysRegistrationFileReader(Parent())


def test_splats_are_claimed(reader, sample_case, tmp_path):
    compressed = ["ply", "format binary_little_endian 1.0", "element chunk 1", "property float min_x"]
    compressed += ["element vertex 2"]
    compressed += [f"property uint packed_{name}" for name in ("position", "rotation", "scale", "color")]
    (tmp_path / "supersplat.ply").write_text("\n".join([*compressed, "end_header", ""]))
    centres = np.zeros((3, 3))
    dos = write_gaussians(tmp_path / "dos.ply", centres, opacities=np.full(3, 0.5), log_scales=centres)
    head, body = dos.read_bytes().split(b"end_header\n", 1)
    dos.write_bytes(head.replace(b"\n", b"\r\n") + b"end_header\r\n" + body)
    for path in (sample_case.splat, tmp_path / "supersplat.ply", dos):
        assert reader.canLoadFile(str(path))
        assert reader.canLoadFileConfidence(str(path)) > MODELS_READER


def test_everything_else_is_left_alone(reader, sample_case, tmp_path):
    (tmp_path / "empty.ply").touch()
    (tmp_path / "folder.ply").mkdir()
    (tmp_path / "bytes.ply").write_bytes(b"ply\n" + bytes(range(128, 256)) * 100)
    late = b"ply\nformat ascii 1.0\n" + b"comment x\n" * HEADER_BYTES + b"element vertex 1\nproperty float opacity\n"
    (tmp_path / "late.ply").write_bytes(late)
    strokes = ["ply", "format ascii 1.0", "element vertex 1", "property float x", "element stroke 1"]
    strokes += [f"property float {name}" for name in ("x", "y", "z", "opacity")]
    (tmp_path / "strokes.ply").write_text("\n".join([*strokes, "end_header", "0", "0 0 0 0", ""]))
    paths = [write_mesh(tmp_path / "mesh.ply"), write_points(tmp_path / "points.ply", np.zeros((2, 3)))]
    paths += [
        tmp_path / name for name in ("empty.ply", "folder.ply", "bytes.ply", "late.ply", "strokes.ply", "missing.ply")
    ]
    for path in (*paths, sample_case.labels):
        assert reader.canLoadFileConfidence(str(path)) == 0
        assert not reader.canLoadFile(str(path))


def test_load_hands_over_the_node(scene, reader, sample_case):
    assert reader.load({"fileName": str(sample_case.splat), "name": "endoscope"})
    (node_id,) = reader.parent.loadedNodes
    node = scene.GetNodeByID(node_id)
    assert is_splat(node) and node.GetName() == "endoscope"


def test_a_damaged_splat_is_told_and_leaves_nothing(scene, reader, sample_case, tmp_path, scene_contents):
    (tmp_path / "cut.ply").write_bytes(sample_case.splat.read_bytes()[:5000])
    before = scene_contents()
    assert reader.canLoadFileConfidence(str(tmp_path / "cut.ply")) > MODELS_READER
    assert reader.load({"fileName": str(tmp_path / "cut.ply")}) is False
    assert "truncated" in reader.parent.messages.GetNthMessageText(0)
    assert scene_contents() == before
