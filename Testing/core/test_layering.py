"""Imports are law: every file of the core imports its own floor and the floors its row of the table names."""

from __future__ import annotations

import ast
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[2] / "OrganPhysRegistration" / "organphys"

FLOOR = {
    "ground": 0,
    "points": 1,
    "readers": 2,
    "align": 3,
    "mechanics": 4,
    "basis": 5,
    "elastic": 6,
    "asset": 7,
    "simulation": 8,
    "exports": 9,
    "pipeline": 10,
}
MAY_IMPORT = {
    "ground": set(),
    "points": {"ground"},
    "readers": {"ground", "points"},
    "align": {"ground", "points"},
    "mechanics": {"ground"},
    "basis": {"ground", "points", "mechanics"},
    "elastic": {"ground", "points", "align", "mechanics", "basis"},
    "asset": {"ground", "points", "mechanics", "basis"},
    "simulation": {"ground", "points", "mechanics", "basis", "asset"},
    "exports": {"ground", "points", "asset", "simulation"},
    "pipeline": set(FLOOR),
}
NUMERIC = {"numpy", "scipy"}
THIRD_PARTY = {
    "ground": {"numpy"},
    "points": NUMERIC,
    "readers": NUMERIC | {"SimpleITK", "plyfile", "vtk", "vtkmodules"},
    "align": NUMERIC,
    "mechanics": NUMERIC,
    "basis": NUMERIC,
    "elastic": NUMERIC,
    "asset": NUMERIC,
    "simulation": NUMERIC | {"torch", "warp", "threadpoolctl"},
    "exports": NUMERIC | {"vtk", "vtkmodules", "matplotlib", "PIL", "SimpleITK", "plyfile", "meshio", "pytetwild"},
    "pipeline": NUMERIC | {"threadpoolctl"},
}
THIRD_PARTY_OF_FILE = {  # a file whose name starts so may import this as well
    ("basis", "learned"): {"torch"},
    ("simulation", "psm_newton"): {"newton"},
    ("pipeline", "batch"): {"dask", "distributed"},
}
DRAWS = ("exports", "vtk_pictures")  # only this file may load VTK's rendering, and only when it is asked to draw
LAZY_ROOT = {"__init__.py", "__main__.py"}  # the public names and `python -m organphys`: they may name every floor


def core_files() -> list[Path]:
    return sorted(path for path in PACKAGE.rglob("*.py") if "__pycache__" not in path.parts)


def imported_modules(source: str, package: tuple[str, ...]) -> set[str]:
    """Absolute names of all modules that ``source`` imports, also inside functions; ``package`` holds the file."""
    found = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            if node.level:
                base = package[: len(package) - node.level + 1]
                stem = ".".join((*base, *([node.module] if node.module else [])))
            else:
                stem = node.module or ""
            # `from . import name` and `from vtkmodules import vtkX` may name modules
            found |= {stem, *(f"{stem}.{alias.name}" for alias in node.names)}
    return found


def violations(floor: str, stem: str, modules: set[str]) -> list[str]:
    """What a file ``stem`` on ``floor`` imports and may not."""
    third_party = set(THIRD_PARTY[floor])
    for (where, start), extra in THIRD_PARTY_OF_FILE.items():
        if floor == where and stem.startswith(start):
            third_party |= extra
    bad = []
    for module in sorted(modules):
        top, *rest = module.split(".")
        if top == "organphys":
            target = rest[0] if rest else ""
            if target in FLOOR and target != floor and target not in MAY_IMPORT[floor]:
                bad.append(module)
        elif top not in sys.stdlib_module_names and top not in third_party:
            bad.append(module)
        rendering = any("rendering" in part.lower() for part in module.split(".")) and top in ("vtk", "vtkmodules")
        if rendering and (floor, stem) != DRAWS:
            bad.append(module)
    return bad


def test_table_only_looks_down() -> None:
    for floor, below in MAY_IMPORT.items():
        assert all(FLOOR[name] < FLOOR[floor] for name in below - {floor})


def test_every_file_lies_on_a_floor() -> None:
    for path in core_files():
        parts = path.relative_to(PACKAGE).parts
        assert parts[0] in FLOOR or parts[0] in LAZY_ROOT, f"{path}: not on a floor of the design"


@pytest.mark.parametrize("floor", FLOOR)
def test_imports_of_floor(floor: str) -> None:
    bad = []
    for path in core_files():
        parts = path.relative_to(PACKAGE).with_suffix("").parts
        if parts[0] == floor:
            modules = imported_modules(path.read_text(encoding="utf-8"), ("organphys", *parts[:-1]))
            bad += [f"{'/'.join(parts)} imports {name}" for name in violations(floor, parts[-1], modules)]
    assert not bad, "\n".join(bad)


@pytest.mark.parametrize(
    ("floor", "stem", "source"),
    [
        ("align", "x", "from ..readers import gaussian_ply"),
        ("align", "x", "def f():\n    from ..readers.gaussian_ply import read_splat"),
        ("align", "x", "from .. import readers"),
        ("ground", "x", "import scipy.spatial"),
        ("basis", "rkpm", "import torch"),
        ("readers", "x", "import vtkmodules.vtkRenderingCore"),
        ("readers", "x", "from vtkmodules import vtkRenderingCore"),
        ("points", "x", "from organphys.pipeline.register import register"),
        ("simulation", "x", "from ..elastic.records import ElasticResult"),
        ("exports", "x", "from ..align.records import CoarseView"),
    ],
)
def test_a_breach_is_seen(floor: str, stem: str, source: str) -> None:
    assert violations(floor, stem, imported_modules(source, ("organphys", floor)))


@pytest.mark.parametrize(
    ("floor", "stem", "source"),
    [
        ("basis", "learned_network", "def f():\n    import torch"),
        ("elastic", "x", "from ..align.metrics import surface_distances\nimport numpy as np\nimport json"),
        ("pipeline", "x", "from . import sample_view\nfrom .. import __version__"),
    ],
)
def test_what_is_allowed_passes(floor: str, stem: str, source: str) -> None:
    assert not violations(floor, stem, imported_modules(source, ("organphys", floor)))
