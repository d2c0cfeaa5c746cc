"""The documentation's example for Slicer's Python console runs, and the files of the Slicer commands are there."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import slicer

from organphys import load_asset
from OrganPhysRegistrationLib.inputs import sample_case as sample_case_input
from OrganPhysRegistrationLib.transform_check import mapped_and_expected

ROOT = Path(__file__).resolve().parents[2]
SCRIPTING, TUTORIAL, README = (
    (ROOT / name).read_text(encoding="utf-8")
    for name in ("Resources/Docs/scripting.md", "Resources/Docs/tutorial.md", "README.md")
)


def console_example() -> str:
    blocks = re.findall(r"```python\n(.*?)```", SCRIPTING, flags=re.DOTALL)
    (block,) = [b for b in blocks if "OrganPhysRegistration" in b]
    return block


@pytest.fixture
def console(module, sample_case, tmp_path, monkeypatch) -> dict:
    """The names after the example has run, with the tests' small sample case."""
    load = sample_case_input.load_sample_case
    monkeypatch.setattr(sample_case_input, "load_sample_case", lambda **_: load(folder=sample_case.folder))
    monkeypatch.chdir(tmp_path)
    names = {"slicer": slicer}
    exec(compile(console_example(), "scripting.md", "exec"), names)
    return names


def test_console_example_registers_takes_along_and_exports(console, tmp_path):
    case, files = console["case"], {path.name for path in tmp_path.iterdir()}
    assert case.stage == "elastic"
    assert files == {"liver.stl", "ct_to_scene.h5", "liver.organphys", "report.html"}
    assert console["tumour"].GetParentTransformNode() is case.node("ct_to_scene")
    assert console["tumour"].GetSegmentation().GetNumberOfSegments() == 1
    organ = load_asset(tmp_path / "liver.organphys")
    assert np.isfinite(organ.map_points(organ.volume_points[:100])).all()
    _points_ct, mapped, expected = mapped_and_expected(case, console["splat"])
    assert np.linalg.norm(mapped - expected, axis=1).max() < 0.1  # mm


def test_files_of_the_slicer_commands_exist():
    commands = [line for line in (README + TUTORIAL).splitlines() if line.startswith("Slicer ")]
    assert len(commands) == 3
    for path in re.findall(r"(?:OrganPhys|Testing)[\w/.]*", "\n".join(commands)):
        assert (ROOT / path).exists(), path
