"""Wheel and sdist hold the whole package and nothing else, and the wheel works where it is unpacked.

In an empty environment, with the demo: make test-wheel.
"""

from __future__ import annotations

import configparser
import os
import subprocess
import sys
import tarfile
import zipfile
from email.parser import Parser
from pathlib import Path

import pytest

setuptools = pytest.importorskip("setuptools", minversion="77", reason="building needs setuptools 77")
ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / ".ci"))
from build_distributions import PACKAGES, build  # noqa: E402


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The sdist, and the wheel made from it."""
    return build(tmp_path_factory.mktemp("dist"))


def sources() -> dict[str, bytes]:
    """Every file of the packages, by its path within the wheel."""
    found = {}
    for package in (ROOT / name for name in PACKAGES):
        kept = (p for p in package.rglob("*") if p.is_file() and "__pycache__" not in p.parts)
        found |= {path.relative_to(package.parent).as_posix(): path.read_bytes() for path in kept}
    return found


def test_wheel_holds_the_packages_and_its_own_description(built: tuple[Path, Path]) -> None:
    with zipfile.ZipFile(built[1]) as wheel:
        inside = {name: wheel.read(name) for name in wheel.namelist()}
    about = {name for name in inside if ".dist-info/" in name}
    code = sources()
    assert {name: content for name, content in inside.items() if name not in about} == {
        name: content for name, content in code.items() if name.endswith(".py")
    }
    assert {name.split(".dist-info/")[1] for name in about} == {
        "METADATA", "RECORD", "WHEEL", "entry_points.txt", "top_level.txt",
        "licenses/LICENSE.txt", "licenses/THIRD_PARTY.md",
    }  # fmt: skip


def test_nothing_but_python_would_be_left_behind() -> None:
    assert [name for name in sources() if not name.endswith(".py")] == []


def test_wheel_describes_itself(built: tuple[Path, Path]) -> None:
    with zipfile.ZipFile(built[1]) as wheel:
        about = next(name.split("/")[0] for name in wheel.namelist() if ".dist-info/" in name)
        metadata = Parser().parsestr(wheel.read(f"{about}/METADATA").decode())
        commands = configparser.ConfigParser()
        commands.read_string(wheel.read(f"{about}/entry_points.txt").decode())
    assert (metadata["Name"], metadata["License-Expression"]) == ("organphys", "Apache-2.0")
    assert metadata["Requires-Python"] == ">=3.10"
    assert {"learned", "batch", "gpu", "newton", "tetrahedra", "test"} <= set(metadata.get_all("Provides-Extra", []))
    plain = [line for line in metadata.get_all("Requires-Dist", []) if "extra ==" not in line]
    assert not any(line.startswith(("torch", "warp", "dask", "newton")) for line in plain)
    assert commands["console_scripts"]["organphys"] == "organphys.pipeline.command_line:main"
    assert "# OrganPhys" in metadata.get_payload()


def test_sdist_holds_what_a_build_needs(built: tuple[Path, Path]) -> None:
    with tarfile.open(built[0]) as archive:
        names = {name.split("/", 1)[1] for name in archive.getnames() if "/" in name}
        assert not any(name.startswith("/") or ".." in name for name in archive.getnames())
    assert {"pyproject.toml", "README.md", "LICENSE.txt", "THIRD_PARTY.md", "CHANGELOG.md", "constraints.txt"} <= names
    code = {name for name in names if name.endswith(".py")}
    inside = {f"{Path(package).parent.as_posix()}/" for package in PACKAGES}
    assert {name.removeprefix(folder) for name in code for folder in inside if name.startswith(folder)} == set(
        sources()
    )


def test_unpacked_wheel_is_what_runs(built: tuple[Path, Path], tmp_path: Path) -> None:
    """In place of the checkout: the version, and a sample case read back; the dependencies are those installed."""
    with zipfile.ZipFile(built[1]) as wheel:
        wheel.extractall(tmp_path / "site")
    program = (
        "import sys; from pathlib import Path; import organphys\n"
        "assert Path(organphys.__file__).is_relative_to(sys.argv[1]), organphys.__file__\n"
        "case = organphys.write_sample_case('case', size='small')\n"
        "from organphys.pipeline.command_line import main\n"
        "sys.exit(main(['info', str(case.labels)]) or main(['info', str(case.splat)]))\n"
    )
    environment = {**os.environ, "PYTHONPATH": str(tmp_path / "site")}
    command = [sys.executable, "-c", program, str(tmp_path / "site")]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "label 5" in done.stdout and "Gaussians" in done.stdout


def test_the_repository_stays_as_it_was(built: tuple[Path, Path]) -> None:
    assert not (ROOT / "build" / "lib").exists()
    assert [path for path in built if path.is_relative_to(ROOT)] == []
