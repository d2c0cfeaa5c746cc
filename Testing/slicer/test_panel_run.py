"""Runs from the panel, with the real registration process on the small sample case."""

from __future__ import annotations

import numpy as np
import pytest
import slicer

from OrganPhysRegistrationLib.panel.register_section import RegisterSection
from OrganPhysRegistrationLib.transform_check import mapped_and_expected

# Seconds that the event loop may stand still: a run computed on the main thread would take longer. The figure itself,
# below 0.2 s, is measured by Testing/benchmarks/panel_run.py.
LONGEST_BLOCK = 1.0
TIMEOUT = 120  # seconds


@pytest.fixture
def nodes(host, module, sample_case):
    """The small sample case in the panel."""
    loaded = module.logic.loadSampleCase(folder=sample_case.folder, size="small")
    module.widget.panel.choose(loaded)
    host.process()
    return loaded


@pytest.fixture
def register(module):
    """The section with the Register button."""
    return next(section for section in module.widget.panel.sections if isinstance(section, RegisterSection))


@pytest.fixture
def run_to(host, module, register):
    """``run_to(percent)``: press Register and wait until the bar has come so far; ``run_to()``: until the end."""

    def reached(percent):
        return not register.running or (percent is not None and module.ui.progressBar.value >= percent)

    def run(percent=None):
        if not register.running:
            module.ui.applyButton.click()
        assert register.running, module.ui.messageLabel.text
        host.wait_until(lambda: reached(percent), TIMEOUT)
        host.process()

    return run


def test_register_runs_to_the_end_without_blocking_and_can_be_undone(
    host, module, nodes, run_to, scene_contents, screenshot, view_png
):
    before = scene_contents()
    with host.latency_meter() as meter:
        run_to(40)
    assert module.ui.applyButton.text == "Cancel"
    assert "%" in module.ui.progressBar.format
    screenshot(module.panel, "panel_running")
    with host.latency_meter() as rest:
        run_to()
    assert max(meter.longest, rest.longest) < LONGEST_BLOCK
    case = module.widget.panel.case()
    assert case.stages == ["before", "coarse", "rigid", "elastic"], module.ui.messageLabel.text
    _, mapped, expected = mapped_and_expected(case, nodes["splat"])
    assert np.linalg.norm(mapped - expected, axis=1).max() < 0.1  # mm
    screenshot(module.panel, "panel_done")
    module.ui.layoutButton.click()
    module.ui.endoscopeViewButton.click()
    view_png("overlay", fit=False)
    module.ui.undoButton.click()
    host.process()
    assert scene_contents() == before
    assert module.widget.panel.case() is None
    assert not module.ui.undoButton.enabled


def test_cancel_restores_the_scene(host, module, nodes, run_to, scene_contents):
    before = scene_contents()
    run_to(30)
    module.ui.applyButton.click()
    run_to_end = lambda: module.ui.applyButton.text == "Register"  # noqa: E731
    host.wait_until(run_to_end, TIMEOUT)
    assert scene_contents() == before
    assert "cancelled" in module.ui.messageLabel.text
    assert module.ui.applyButton.enabled
    assert not module.ui.progressBar.visible


def test_single_steps_build_on_each_other(host, module, nodes, register):
    panel = module.widget.panel
    for stage in ("coarse", "rigid"):
        getattr(module.ui, f"{stage}Button").click()
        host.wait_until(lambda: not register.running, TIMEOUT)
        host.process()
        assert panel.case().stage == stage, module.ui.messageLabel.text
        assert panel.parameters.shownStage.value == stage
    assert not module.ui.stageElasticButton.enabled
    assert not module.ui.exportAssetButton.enabled


def test_a_second_start_is_refused_and_the_first_goes_on(host, module, nodes, register, run_to):
    run_to(20)
    first = register.run
    register.start(("coarse",))
    assert register.run is first
    assert "running" in module.ui.messageLabel.text
    module.ui.applyButton.click()
    host.wait_until(lambda: first.finished, TIMEOUT)


def test_an_input_deleted_during_a_run_is_told(host, module, nodes, run_to, scene_contents):
    run_to(20)
    slicer.mrmlScene.RemoveNode(nodes["splat"])
    host.wait_until(lambda: module.ui.applyButton.text == "Register", TIMEOUT)
    assert "splat was removed" in module.ui.messageLabel.text
    assert not module.ui.applyButton.enabled  # the splat has to be chosen first
    assert not any("OrganPhys" in line for line in scene_contents())
    assert host.record.dialogs == []


def test_a_segment_removed_during_a_run_is_told(host, module, nodes, run_to, scene_contents):
    before = scene_contents()
    run_to(30)
    nodes["segmentation"].GetSegmentation().RemoveSegment(nodes["segmentID"])
    run_to()
    assert "segment was removed" in module.ui.messageLabel.text
    assert scene_contents() == before
    assert module.widget.panel.case() is None


def test_a_scene_closed_during_a_run_leaves_nothing(host, module, nodes, run_to, scene_contents):
    run_to(20)
    slicer.mrmlScene.Clear(0)
    host.wait_until(lambda: module.ui.applyButton.text == "Register", TIMEOUT)
    assert "closed" in module.ui.messageLabel.text
    assert [line for line in scene_contents() if "SubjectHierarchy" not in line] == []  # Slicer keeps that one


def test_an_empty_segment_is_told(host, module, nodes):
    empty = nodes["segmentation"].GetSegmentation().AddEmptySegment("", "nothing painted")
    module.widget.panel.parameters.segmentID = empty
    host.process()
    if module.ui.applyButton.enabled:
        module.ui.applyButton.click()
    host.wait_until(lambda: "empty" in module.ui.reasonLabel.text + module.ui.messageLabel.text, TIMEOUT)
    assert host.record.dialogs == []
