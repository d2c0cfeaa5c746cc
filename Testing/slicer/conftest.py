"""The tests of the Slicer module run on the host in ``host/``: see host/README.md for the fixtures.

Where the host cannot run they are skipped with the reason, or fail if ORGANPHYS_REQUIRE_SLICER_TESTS is 1.
"""

from __future__ import annotations

import functools
import os
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

import host as slicer_host
from host.probe import reason_not_to_run

if TYPE_CHECKING:
    from host.session import Host, LoadedModule

HERE = Path(__file__).resolve().parent
OUTPUT = HERE / "output"
MODULE_FOLDER = HERE.parents[1] / "OrganPhysRegistration"
SIMULATION_FOLDER = HERE.parents[1] / "OrganPhysSimulation"
REQUIRED = os.environ.get("ORGANPHYS_REQUIRE_SLICER_TESTS") == "1"
# Nodes that views and the application make when they need them.
OF_THE_APPLICATION = ("vtkMRMLAbstractViewNode", "vtkMRMLCameraNode", "vtkMRMLSliceCompositeNode", "vtkMRMLColorNode")

_SESSION: pytest.StashKey[pytest.Session] = pytest.StashKey()

why_not = functools.cache(reason_not_to_run)


class UnrunnableFile(pytest.Module):
    """A test file that is not imported, because the host cannot run here."""

    def collect(self) -> list[pytest.Item]:
        if REQUIRED:
            raise self.CollectError(f"ORGANPHYS_REQUIRE_SLICER_TESTS=1, but: {why_not()}")
        pytest.skip(why_not(), allow_module_level=True)


def pytest_pycollect_makemodule(module_path: Path, parent: pytest.Collector) -> pytest.Module | None:
    if why_not():
        return UnrunnableFile.from_parent(parent, path=module_path)
    slicer_host.start()  # test files import slicer, qt and vtk at their top
    for folder in (SIMULATION_FOLDER, MODULE_FOLDER):
        if str(folder) not in sys.path:
            sys.path.insert(0, str(folder))
    return None


@pytest.hookimpl(trylast=True)
def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> None:
    session.config.stash[_SESSION] = session
    if exitstatus == pytest.ExitCode.NO_TESTS_COLLECTED and why_not() and not REQUIRED:
        session.exitstatus = pytest.ExitCode.OK  # skipped files count as no tests


@pytest.hookimpl(trylast=True)
def pytest_unconfigure(config: pytest.Config) -> None:
    """End the process here if the host ran: Qt's and VTK's teardown may crash, which would spoil the exit status."""
    session = config.stash.get(_SESSION, None)
    if session is None or slicer_host.running() is None:
        return
    slicer_host.running().remove_files()
    config.get_terminal_writer().flush()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(int(session.exitstatus))


@pytest.fixture(scope="session")
def host() -> Host:
    """The running host; its functions are documented in host/session.py and host/event_loop.py."""
    return slicer_host.start()


@pytest.fixture(autouse=True)
def nothing_goes_wrong(host: Host) -> Iterator[None]:
    """Fails the test if an exception was raised in a callback or VTK reported an error.

    A test that provokes either looks at ``host.record`` and clears what it expected.
    """
    host.record.clear()
    yield
    host.process()
    wrong = host.record.errors + [f"VTK: {text}" for text in host.record.vtk_errors]
    host.record.clear()
    assert not wrong, "\n".join(wrong)


@pytest.fixture
def scene(host: Host) -> Iterator[object]:
    """slicer.mrmlScene, empty before and after the test."""
    import slicer

    host.clear_scene()
    yield slicer.mrmlScene
    host.clear_scene()


@pytest.fixture
def module(host: Host, scene: object) -> Iterator[LoadedModule]:
    """OrganPhysRegistration with a fresh panel, entered: .widget, .ui, .logic, .instance, .panel (its Qt widget)."""
    loaded = host.load(MODULE_FOLDER / "OrganPhysRegistration.py")
    if loaded.panel is None:
        host.show(loaded)
    yield loaded
    if loaded.panel is not None:
        host.close(loaded)


@pytest.fixture(scope="session")
def simulation_files(tmp_path_factory: pytest.TempPathFactory) -> object:
    """A small registered organ and its splat as files: .asset, .splat."""
    from simulation_example import write_example

    return write_example(tmp_path_factory.mktemp("simulation"))


@pytest.fixture
def simulation(host: Host, scene: object) -> Iterator[LoadedModule]:
    """OrganPhysSimulation with a fresh panel, entered, for small bodies; its attributes are those of ``module``."""
    from simulation_example import FINENESS

    loaded = host.load(SIMULATION_FOLDER / "OrganPhysSimulation.py")
    if loaded.panel is None:
        host.show(loaded)
    loaded.logic.fineness = dict(FINENESS)
    yield loaded
    if loaded.panel is not None:
        host.close(loaded)


@pytest.fixture
def panel(module: LoadedModule) -> object:
    """The panel's Qt widget, 420 px wide."""
    return module.panel


@pytest.fixture(scope="session")
def output_folder() -> Path:
    OUTPUT.mkdir(exist_ok=True)
    return OUTPUT


@pytest.fixture
def screenshot(host: Host, output_folder: Path) -> Callable[..., Path]:
    """``screenshot(widget, name)`` -> Testing/slicer/output/<name>.png, the widget in its full height."""

    def take(widget: object, name: str, width: int = 420) -> Path:
        host.screenshot(widget, output_folder / f"{name}.png", width)
        return output_folder / f"{name}.png"

    return take


@pytest.fixture
def view_png(output_folder: Path) -> Callable[..., Path]:
    """``view_png(name, view="3D")`` -> Testing/slicer/output/<name>.png of the 3D view, or of "Red", "Green", "Yellow".

    The 3D view is fitted to what is shown unless ``fit=False``.
    """
    import slicer

    def take(name: str, view: str = "3D", fit: bool = True) -> Path:
        manager = slicer.app.layoutManager()
        widget = manager.threeDWidget(0) if view == "3D" else manager.sliceWidget(view)
        if fit:
            widget.view.fit()
        widget.view.png(output_folder / f"{name}.png")
        return output_folder / f"{name}.png"

    return take


@pytest.fixture
def scene_contents(scene: object) -> Callable[[], frozenset[str]]:
    """Function: what is in the scene now, one line per node and subject-hierarchy item; compare before and after."""
    import slicer

    def contents() -> frozenset[str]:
        hierarchy = slicer.vtkMRMLSubjectHierarchyNode.GetSubjectHierarchyNode(scene)  # makes it at first use
        nodes = [scene.GetNthNode(i) for i in range(scene.GetNumberOfNodes())]
        own = [n for n in nodes if not n.GetSingletonTag() and not any(n.IsA(c) for c in OF_THE_APPLICATION)]
        items: list[int] = []
        hierarchy.GetItemChildren(hierarchy.GetSceneItemID(), items, True)
        names = [f"item {item} {hierarchy.GetItemName(item)}" for item in items]
        return frozenset([f"{n.GetClassName()} {n.GetID()} {n.GetName()}" for n in own] + names)

    return contents


@pytest.fixture(scope="session")
def sample_case(tmp_path_factory: pytest.TempPathFactory) -> object:
    """The generated sample case, small: .labels, .organ, .splat, .landmarks, .truth, .mm_per_unit."""
    from organphys.pipeline.sample_case import write_sample_case

    return write_sample_case(tmp_path_factory.mktemp("sample_case"), size="small")
