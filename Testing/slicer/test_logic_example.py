"""The README's console example, run as it stands there: load, register, take a second segment along, export."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import slicer
from outcome_example import world_points
from vtk.util.numpy_support import vtk_to_numpy

from organphys.asset.asset_file import load_asset

EXAMPLE = """\
from OrganPhysRegistration import OrganPhysRegistrationLogic

logic = OrganPhysRegistrationLogic()
sample = logic.loadSampleCase()  # your own: slicer.util.loadSegmentation(...), logic.loadSplat("splat.ply")

case = logic.register(
    sample["segmentation"], sample["segmentID"], sample["splat"], landmarksNode=sample["landmarks"]
)
print(case.record["metrics"]["elastic"]["trim30_splat_to_ct"])  # {"value": ..., "unit": "mm"}
for code, warning in case.record["notices"]:
    print(warning)

tumour = logic.applyTransformToSegment(case, sample["segmentation"], "Segment_4")  # in the endoscope's scene, mm
logic.export(case, "surface", "liver.stl")
logic.export(case, "transform", "ct_to_scene.h5")
logic.export(case, "asset", "liver.organphys")
logic.export(case, "report", "report.html")
"""


@pytest.fixture
def small_sample(monkeypatch: pytest.MonkeyPatch, sample_case: Any) -> None:
    """The sample case of the tests in place of the full one."""
    from OrganPhysRegistrationLib.inputs import sample_case as module

    load = module.load_sample_case
    monkeypatch.setattr(module, "load_sample_case", lambda **_: load(folder=sample_case.folder))


def test_console_example(
    scene: Any, small_sample: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    exec(EXAMPLE, names)
    assert "'unit': 'mm'" in capsys.readouterr().out
    assert {file.name for file in tmp_path.iterdir()} == {
        "liver.stl", "ct_to_scene.h5", "liver.organphys", "report.html"
    }  # fmt: skip
    case, tumour = names["case"], names["tumour"]
    assert tumour.GetParentTransformNode() is case.node("ct_to_scene")
    assert tumour.GetSegmentation().GetNumberOfSegments() == 1
    organ = load_asset(tmp_path / "liver.organphys")
    surface = slicer.util.loadModel(str(tmp_path / "liver.stl"))
    written = vtk_to_numpy(surface.GetPolyData().GetPoints().GetData())
    expected = vtk_to_numpy(case.node("surface_elastic").GetPolyData().GetPoints().GetData())
    assert np.abs(written.mean(0) - expected.mean(0)).max() < 1.0
    loaded = slicer.util.loadTransform(str(tmp_path / "ct_to_scene.h5"))
    points = organ.volume_points[::200]
    np.testing.assert_allclose(world_points(loaded, points), world_points(case.node("ct_to_scene"), points), atol=1e-3)


@pytest.mark.parametrize(("what", "given", "written"), [("surface", "liver", "liver.stl"), ("report", "out", None)])
def test_exports_complete_the_name(
    scene: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, what: str, given: str, written: str | None
) -> None:
    from OrganPhysRegistrationLib.logic import OrganPhysRegistrationLogic
    from OrganPhysRegistrationLib.outputs import case_exports, report_export

    calls: list[Path] = []
    keep: Callable[..., None] = lambda case, path: calls.append(path)  # noqa: E731
    monkeypatch.setattr(case_exports, "export_surface", keep)
    monkeypatch.setattr(report_export, "export_report", keep)
    logic = OrganPhysRegistrationLogic()
    path = logic.export(None, what, tmp_path / given)
    assert path == str(calls[0]) == str(tmp_path / (written or "out/report.html"))
    logic.cleanup()
