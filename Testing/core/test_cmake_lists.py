"""The CMake lists name every file of the extension, and the catalogue entry keeps to its schema.

A file that is not listed works in development and is missing once the extension is installed.
"""

import json
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
MODULES = [path.parent for path in sorted(ROOT.glob("OrganPhys*/CMakeLists.txt"))]
CATALOGUE_KEYS = {
    "$schema", "category", "scm_url", "scm_revision", "scm_type", "build_dependencies", "build_subdirectory", "tier",
}  # fmt: skip


def listed(module: Path, name: str) -> list[str]:
    """Entries of ``set(name ...)`` in the module's CMakeLists.txt."""
    text = re.sub(r"#.*", "", (module / "CMakeLists.txt").read_text())
    found = re.search(rf"set\({name}\s+([^)]*)\)", text)
    assert found, f"{module.name}/CMakeLists.txt has no set({name} ...)"
    return found.group(1).replace("${MODULE_NAME}", module.name).split()


def present(folder: Path, pattern: str, module: Path) -> set[str]:
    files = (path for path in folder.rglob(pattern) if path.is_file())
    kept = (path.relative_to(module) for path in files)
    return {path.as_posix() for path in kept if "__pycache__" not in path.parts and ".egg-info" not in str(path)}


def test_both_modules_are_there():
    assert [module.name for module in MODULES] == ["OrganPhysRegistration", "OrganPhysSimulation"]


@pytest.mark.parametrize("module", MODULES, ids=lambda module: module.name)
def test_every_python_file_is_listed(module):
    assert set(listed(module, "MODULE_PYTHON_SCRIPTS")) == present(module, "*.py", module)


@pytest.mark.parametrize("module", MODULES, ids=lambda module: module.name)
def test_every_resource_is_listed(module):
    assert set(listed(module, "MODULE_PYTHON_RESOURCES")) == present(module / "Resources", "*", module)


@pytest.mark.parametrize("module", MODULES, ids=lambda module: module.name)
@pytest.mark.parametrize("name", ["MODULE_PYTHON_SCRIPTS", "MODULE_PYTHON_RESOURCES"])
def test_nothing_is_listed_twice(module, name):
    entries = listed(module, name)
    assert len(entries) == len(set(entries))


def test_nothing_but_python_in_the_packages_would_be_left_behind():
    core, registration, simulation = "organphys", "OrganPhysRegistrationLib", "OrganPhysSimulationLib"
    for module, package in ((MODULES[0], core), (MODULES[0], registration), (MODULES[1], simulation)):
        packages = present(module / package, "*", module)
        assert packages, package
        assert [name for name in packages if not name.endswith(".py")] == []


def test_the_extension_adds_every_module():
    text = (ROOT / "CMakeLists.txt").read_text()
    for module in MODULES:
        assert f"add_subdirectory({module.name})" in text


def test_pictures_of_the_extension_are_there():
    text = (ROOT / "CMakeLists.txt").read_text()
    pictures = re.findall(r"/main/(Resources/[\w./]+\.png)", text)
    assert len(pictures) >= 2
    assert [name for name in pictures if not (ROOT / name).is_file()] == []


def test_catalogue_entry_follows_the_schema():
    entry = json.loads((ROOT / "Resources" / "OrganPhys.json").read_text())
    assert {"$schema", "category", "scm_url"} <= set(entry) <= CATALOGUE_KEYS | {"enabled", "dicom_support_rule"}
    assert isinstance(entry["build_dependencies"], list)
    assert 1 <= entry["tier"] <= 5
    homepage = re.search(r'EXTENSION_HOMEPAGE "([^"]+)"', (ROOT / "CMakeLists.txt").read_text())
    assert homepage is not None
    assert entry["scm_url"] == homepage.group(1) + ".git"
