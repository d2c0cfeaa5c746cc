"""Missing Python packages: one question, pinned neighbours, and plain words when it does not work."""

from __future__ import annotations

import importlib.machinery
import importlib.metadata
import subprocess
import sys
import types
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import slicer

from OrganPhysRegistrationLib import dependencies
from OrganPhysRegistrationLib.dependencies import DependencyError, ensure_packages, missing_packages


@pytest.fixture
def absent(monkeypatch: pytest.MonkeyPatch) -> set[str]:
    """Names of modules that seem not to be installed."""
    gone: set[str] = set()
    found = dependencies._is_found
    monkeypatch.setattr(dependencies, "_is_found", lambda module: module not in gone and found(module))
    return gone


@pytest.fixture
def questions(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What was asked; the answer is yes unless "declined" is in the list."""
    asked: list[str] = []

    def confirm(text: str, **options: Any) -> bool:
        asked.append(text)
        return "declined" not in asked

    monkeypatch.setattr(slicer.util, "confirmOkCancelDisplay", confirm)
    return asked


@pytest.fixture
def pip(monkeypatch: pytest.MonkeyPatch, absent: set[str]) -> list[list[str]]:
    """slicer.util.pip_install of Slicer 5.10; what it "installs" is found from then on."""
    calls: list[list[str]] = []

    def install(requirements: list[str]) -> None:
        constraints = Path(requirements[1]).read_text()
        calls.append([*requirements[2:], constraints])
        absent.clear()

    monkeypatch.setattr(slicer.util, "pip_install", install)
    monkeypatch.setattr(dependencies, "_package_manager", lambda: None)
    return calls


def test_nothing_is_asked_where_nothing_is_missing(questions: list[str]) -> None:
    assert missing_packages() == ()
    ensure_packages()
    assert questions == []


def test_probing_imports_nothing() -> None:
    code = (
        "import sys, types; slicer = types.ModuleType('slicer'); sys.modules['slicer'] = slicer;"
        f"sys.path.insert(0, {str(Path(dependencies.__file__).parents[1])!r});"
        "from OrganPhysRegistrationLib.dependencies import missing_packages; missing_packages();"
        "print([m for m in ('scipy', 'matplotlib', 'plyfile', 'PIL', 'threadpoolctl', 'torch') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_one_question_names_packages_and_size(absent: set[str], questions: list[str], pip: list[list[str]]) -> None:
    absent |= {"plyfile", "matplotlib"}
    ensure_packages()
    assert len(questions) == 1
    assert "plyfile>=1.0.3, matplotlib>=3.8" in questions[0] and "about 17 MB" in questions[0]


def test_what_slicer_brings_is_pinned(absent: set[str], questions: list[str], pip: list[list[str]]) -> None:
    absent.add("plyfile")
    ensure_packages()
    [[requirement, constraints]] = pip
    assert requirement == "plyfile>=1.0.3"
    assert f"numpy=={np.__version__}\n" in constraints and "scipy==" in constraints
    assert "+" not in constraints  # of a local torch build, which no index knows
    assert f"SimpleITK=={importlib.metadata.version('SimpleITK')}" in constraints


def test_slicer_5_12_installs_through_its_own_packaging(
    absent: set[str], questions: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: list[dict[str, Any]] = []

    def pip_ensure(requirements: list[Any], **options: Any) -> None:
        wanted = [f"{one.name}{one.specifier}" for one in requirements if one.marker is None]  # as Slicer reads them
        calls.append({"requirements": wanted, **options})
        absent.clear()

    monkeypatch.setattr(dependencies, "_package_manager", lambda: types.SimpleNamespace(pip_ensure=pip_ensure))
    absent.add("threadpoolctl")
    ensure_packages()
    assert calls[0]["requirements"] == ["threadpoolctl>=3.2"]
    assert calls[0]["requester"] == "OrganPhys" and calls[0]["prompt_install"] is False
    assert len(questions) == 1


def test_declining_says_what_to_do(absent: set[str], questions: list[str], pip: list[list[str]]) -> None:
    absent.add("plyfile")
    questions.append("declined")
    with pytest.raises(DependencyError, match=r"cannot run without plyfile>=1\.0\.3: .* accept"):
        ensure_packages()
    assert pip == []


@pytest.mark.parametrize("error", [subprocess.CalledProcessError(1, "pip"), OSError("no route to host")])
def test_offline_says_what_to_do(
    absent: set[str], questions: list[str], monkeypatch: pytest.MonkeyPatch, error: Exception
) -> None:
    def fail(requirements: list[str]) -> None:
        raise error

    monkeypatch.setattr(slicer.util, "pip_install", fail)
    monkeypatch.setattr(dependencies, "_package_manager", lambda: None)
    absent.add("plyfile")
    with pytest.raises(DependencyError, match="check the internet connection"):
        ensure_packages()


def test_installed_but_not_found_asks_for_a_restart(
    absent: set[str], questions: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(slicer.util, "pip_install", lambda requirements: None)
    monkeypatch.setattr(dependencies, "_package_manager", lambda: None)
    absent.add("plyfile")
    with pytest.raises(DependencyError, match="restart Slicer"):
        ensure_packages()


def test_slicers_own_packages_are_never_installed(absent: set[str], questions: list[str], pip: list[list[str]]) -> None:
    absent |= {"SimpleITK", "plyfile"}
    with pytest.raises(DependencyError, match="reinstall Slicer"):
        ensure_packages()
    assert questions == [] and pip == []


def test_learned_weights_need_the_pytorch_extension(absent: set[str], questions: list[str]) -> None:
    absent |= {"torch", "PyTorchUtils"}
    ensure_packages()
    with pytest.raises(DependencyError, match="PyTorch extension: install it in the Extensions Manager"):
        ensure_packages(weights="learned")


@pytest.mark.parametrize("answer", [None, object()])
def test_torch_is_installed_by_the_pytorch_extension(
    absent: set[str], monkeypatch: pytest.MonkeyPatch, answer: object
) -> None:
    calls: list[dict[str, Any]] = []

    class Logic:
        def installTorch(self, **options: Any) -> object:
            calls.append(options)
            return answer

    monkeypatch.setitem(sys.modules, "PyTorchUtils", types.SimpleNamespace(PyTorchUtilsLogic=Logic))
    absent.add("torch")
    if answer is None:
        with pytest.raises(DependencyError, match="PyTorch was not installed"):
            ensure_packages(weights="learned")
    else:
        ensure_packages(weights="learned")
    assert calls == [{"askConfirmation": True, "torchVersionRequirement": ">=2.4"}]


@pytest.mark.parametrize("name", ["slicer.packaging", "slicer.pydeps"])
def test_the_package_manager_is_found_under_both_names(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    assert dependencies._package_manager() is None  # as in Slicer 5.10
    manager = types.ModuleType(name)
    manager.__spec__ = importlib.machinery.ModuleSpec(name, None)
    monkeypatch.setitem(sys.modules, name, manager)
    assert dependencies._package_manager() is manager
