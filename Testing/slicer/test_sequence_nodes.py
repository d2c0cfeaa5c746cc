"""A followed organ in Slicer: sequence nodes that play, made in the background from a folder of splats."""

from __future__ import annotations

import json
import shutil

import numpy as np
import outcome_example as example
import pytest
import slicer
from vtk.util.numpy_support import vtk_to_numpy

from organphys.ground.checks import InputError
from OrganPhysRegistrationLib.inputs.matrices import to_parent
from OrganPhysRegistrationLib.inputs.splat_scale import scene_to_world
from OrganPhysRegistrationLib.outputs import sequence_nodes
from OrganPhysRegistrationLib.panel.sequence_section import SequenceSection
from OrganPhysRegistrationLib.runs.stepped_work import run_at_once

TIMEOUT = 300  # seconds; CI machines are slow


@pytest.fixture
def folder(tmp_path):
    """What the registration process leaves: three frames of the example organ, moved along."""
    organ = example.organ()
    np.save(tmp_path / "faces.npy", organ.faces.astype(np.int32))
    matrices = []
    for k in range(3):
        np.save(tmp_path / f"frame_{k}.npy", (organ.scene_vertices + np.array([0.0, 0.0, 0.1 * k])).astype(np.float32))
        matrix = organ.T_scene_ct.matrix.copy()
        matrix[2, 3] += 0.1 * k
        matrices.append(matrix.tolist())
    facts = {"times": [0.0, 0.5, 1.0], "time_unit": "s", "status": ["first", "tracked", "tracked"],
             "T_scene_ct": matrices, "notices": [], "figures": {}}  # fmt: skip
    (tmp_path / "sequence.json").write_text(json.dumps(facts))
    return tmp_path


def points_of(node):
    return vtk_to_numpy(node.GetMesh().GetPoints().GetData())


def test_browser_plays_surface_and_transform(host, scene, folder):
    splat = example.splat_node(scene)
    nodes = run_at_once(sequence_nodes.sequence_steps(folder, splat, "Liver"))
    assert nodes.surfaces.GetNumberOfDataNodes() == nodes.transforms.GetNumberOfDataNodes() == 3
    assert nodes.surfaces.GetIndexUnit() == "s" and nodes.browser.GetPlaybackRateFps() == pytest.approx(2.0)
    organ = example.organ()
    for k in (2, 0, 1):
        nodes.browser.SetSelectedItemNumber(k)
        slicer.modules.sequences.logic().UpdateProxyNodesFromSequences(nodes.browser)
        np.testing.assert_allclose(
            points_of(nodes.surface), organ.scene_vertices + np.array([0, 0, 0.1 * k]), atol=1e-4
        )
        assert nodes.surface.GetTransformNodeID() == splat.GetTransformNodeID()  # in scene units under the splat's own
        expected = to_parent(scene_to_world(splat)) @ np.array(nodes.facts["T_scene_ct"][k])
        np.testing.assert_allclose(to_parent(nodes.ct_to_scene), expected, atol=1e-6)


def test_broken_folder_leaves_nothing(host, scene, folder, scene_contents):
    splat = example.splat_node(scene)
    before = scene_contents()
    (folder / "frame_2.npy").unlink()
    with pytest.raises(FileNotFoundError):
        run_at_once(sequence_nodes.sequence_steps(folder, splat, "Liver"))
    assert scene_contents() == before


def test_missing_sequences_are_told(monkeypatch):
    monkeypatch.setattr(sequence_nodes, "CLASSES", ("vtkMRMLNoSuchNode",))
    with pytest.raises(InputError, match="Sequences module"):
        sequence_nodes.check_sequences()


def test_panel_follows_a_folder_of_splats(host, module, sample_case, tmp_path, screenshot):
    loaded = module.logic.loadSampleCase(folder=sample_case.folder, size="small")
    module.widget.panel.choose(loaded)
    section = next(one for one in module.widget.panel.sections if isinstance(one, SequenceSection))
    splats = tmp_path / "splats"
    splats.mkdir()
    for name in ("t_2.ply", "t_10.ply"):
        shutil.copy(sample_case.splat, splats / name)
    module.ui.sequenceButton.collapsed = False
    module.ui.sequenceFolderEdit.text = str(tmp_path / "nothing")
    module.ui.fpsSpinBox.value = 10.0
    host.process()
    module.ui.followButton.click()
    host.wait_until(lambda: not section.running, TIMEOUT)
    assert "found 0 .ply files" in module.ui.sequenceLabel.text
    module.ui.sequenceFolderEdit.text = str(splats)
    host.process()
    module.ui.followButton.click()
    host.wait_until(lambda: not section.running, TIMEOUT)
    host.process()
    nodes = section.nodes()
    assert nodes is not None, module.ui.sequenceLabel.text
    assert nodes.facts["status"] == ["first", "tracked"] and nodes.facts["times"] == [0.0, 0.1]
    assert section.run.file.is_file()
    assert module.ui.playButton.enabled and "2 frames followed" in module.ui.sequenceLabel.text
    screenshot(module.panel, "panel_sequence")
