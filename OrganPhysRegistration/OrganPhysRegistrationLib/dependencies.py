"""Python packages that the core needs and Slicer may not have: asked for once, at first use, never at import.

What Slicer itself brings (numpy, scipy, SimpleITK, torch of the PyTorch extension) is pinned while installing, so that
nothing of it is replaced.
"""

from __future__ import annotations

import importlib
import importlib.metadata
import importlib.util
import logging
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import slicer

from organphys.ground.checks import InputError

REQUESTER = "OrganPhys"
SHIPPED = ("numpy", "vtk", "SimpleITK")  # part of every Slicer: never installed by an extension
PINNED = ("numpy", "scipy", "SimpleITK", "torch")
TORCH = ">=2.4"


class DependencyError(InputError):
    """A package is missing; the message says what the user can do."""


@dataclass(frozen=True)
class Package:
    """module: name to import; requirement: what pip is asked for; download_mb: MB, with what it brings along."""

    module: str
    requirement: str
    download_mb: int


PACKAGES = (
    Package("scipy", "scipy>=1.13", 40),
    Package("plyfile", "plyfile>=1.0.3", 1),
    Package("threadpoolctl", "threadpoolctl>=3.2", 1),
    Package("matplotlib", "matplotlib>=3.8", 16),
    Package("PIL", "pillow>=10", 7),
)


def missing_packages() -> tuple[Package, ...]:
    """Packages of PACKAGES that cannot be found; nothing is imported."""
    return tuple(package for package in PACKAGES if not _is_found(package.module))


def ensure_packages(*, weights: str = "rkpm") -> None:
    """Install what is missing after one question; DependencyError if it is declined or fails.

    ``weights``: "learned" needs torch too, which only the PyTorch extension may install. In test mode the question
    accepts itself.
    """
    absent = [name for name in SHIPPED if not _is_found(name)]
    if absent:
        raise DependencyError(f"Slicer's own Python package {absent[0]} is missing: reinstall Slicer.")
    missing = missing_packages()
    if missing:
        _install(missing)
    if weights == "learned":
        _ensure_torch()


def _is_found(module: str) -> bool:
    return module in sys.modules or importlib.util.find_spec(module) is not None


def _names(packages: tuple[Package, ...]) -> str:
    return ", ".join(package.requirement for package in packages)


def _install(missing: tuple[Package, ...]) -> None:
    size = sum(package.download_mb for package in missing)
    question = (
        f"{REQUESTER} needs Python packages that are not installed in Slicer yet:\n\n{_names(missing)}\n\n"
        f"Download and install them now (about {size} MB)? Nothing that Slicer brings is changed."
    )
    if not slicer.util.confirmOkCancelDisplay(question, windowTitle="Install Python packages"):
        raise DependencyError(f"{REQUESTER} cannot run without {_names(missing)}: press Register again and accept.")
    logging.info("OrganPhys: installing %s", _names(missing))
    try:
        _pip(missing)
    except (RuntimeError, OSError, subprocess.SubprocessError) as error:
        logging.error("OrganPhys: %s", error)
        raise DependencyError(
            f"{_names(missing)} could not be installed: check the internet connection (or the proxy) and press "
            "Register again; Slicer's log has the details. Slicer itself is unchanged."
        ) from error
    importlib.invalidate_caches()
    left = missing_packages()
    if left:
        raise DependencyError(f"{_names(left)} cannot be found after the installation: restart Slicer and try again.")


def _pip(missing: tuple[Package, ...]) -> None:
    """pip through Slicer: its package management from 5.12 on, ``slicer.util.pip_install`` before."""
    requirements = [package.requirement for package in missing]
    with tempfile.TemporaryDirectory(prefix="organphys_") as folder:
        constraints = Path(folder) / "constraints.txt"
        constraints.write_text("".join(f"{line}\n" for line in _pins()), encoding="utf-8")
        manager = _package_manager()
        if hasattr(manager, "pip_ensure"):
            from packaging.requirements import Requirement  # part of every Slicer that has pip_ensure

            manager.pip_ensure(
                [Requirement(requirement) for requirement in requirements],
                constraints=str(constraints),
                prompt_install=False,  # asked already
                requester=REQUESTER,
                skip_in_testing=False,
            )
        else:
            slicer.util.pip_install(["--constraint", str(constraints), *requirements])


def _pins() -> list[str]:
    """``name==version`` of the packages that must stay as they are."""
    pins = []
    for name in PINNED:
        try:
            version = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            continue  # not there: nothing to keep
        pins.append(f"{name}=={version.split('+')[0]}")
    return pins


def _package_manager() -> Any:
    """Slicer's module with ``pip_ensure``; None in Slicer 5.10."""
    known = ("slicer.packaging", "slicer.pydeps")  # the second is its later name
    found = [name for name in known if importlib.util.find_spec(name) is not None]
    return importlib.import_module(found[0]) if found else None


def _ensure_torch() -> None:
    if _is_found("torch"):
        return
    other = "or choose the RKPM weights"
    if not _is_found("PyTorchUtils"):
        raise DependencyError(
            "Learned weights need the PyTorch extension: install it in the Extensions Manager and restart Slicer, "
            f"{other}."
        )
    torch_logic = importlib.import_module("PyTorchUtils").PyTorchUtilsLogic()
    torch = torch_logic.installTorch(askConfirmation=True, torchVersionRequirement=TORCH)
    if torch is None:
        raise DependencyError(f"PyTorch was not installed: press Register again and accept, {other}.")
