"""pytest's exit status stays true, although the process ends without the interpreter's teardown."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
GREEN = "def test_green(scene):\n    assert scene is not None\n"
RED = "def test_red(scene):\n    assert scene is None\n"
SLOT = "import qt\n\ndef test_slot(host):\n    qt.QTimer.singleShot(0, lambda: 1 / 0)\n    host.wait(0.05)\n"
VTK = "def test_vtk(scene):\n    scene.ReadFromMRB('/nowhere.mrb', 0)\n"


def run_pytest(folder: Path, content: str, **environment: str) -> subprocess.CompletedProcess[str]:
    (folder / "test_case.py").write_text(content)
    command = [sys.executable, "-m", "pytest", "-p", "conftest", "-p", "no:cacheprovider", "-rs", "test_case.py"]
    environment = {**os.environ, "PYTHONPATH": str(HERE), "ORGANPHYS_REQUIRE_SLICER_TESTS": "0", **environment}
    environment.pop("PYTEST_ADDOPTS", None)  # meant for the tests that run this one
    return subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, timeout=120, check=False
    )


def test_status_is_zero_when_all_is_well(tmp_path):
    result = run_pytest(tmp_path, GREEN)
    assert result.returncode == 0 and "1 passed" in result.stdout


def test_status_is_one_after_a_failure_an_exception_in_a_slot_or_a_vtk_error(tmp_path):
    result = run_pytest(tmp_path, GREEN + RED + SLOT + VTK)
    assert result.returncode == 1 and "1 failed, 3 passed, 2 errors" in result.stdout


def test_host_that_cannot_run_is_a_skip_with_the_reason(tmp_path):
    result = run_pytest(tmp_path, GREEN, QT_QPA_PLATFORM="no-such-platform")
    assert result.returncode == 0 and "apt-get install" in result.stdout and "passed" not in result.stdout


def test_host_that_cannot_run_is_a_failure_where_it_is_required(tmp_path):
    environment = {"QT_QPA_PLATFORM": "no-such-platform", "ORGANPHYS_REQUIRE_SLICER_TESTS": "1"}
    assert run_pytest(tmp_path, GREEN, **environment).returncode not in (0, 1)
