"""What a fresh interpreter has loaded: importing is cheap, and the default method needs no torch and no rendering."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

HEAVY = ("torch", "warp", "vtk", "vtkmodules", "SimpleITK", "matplotlib", "scipy", "plyfile")
TELL = "import sys, json; print(json.dumps(sorted(sys.modules)))"


def modules_after(code: str) -> set[str]:
    done = subprocess.run([sys.executable, "-c", f"{code}\n{TELL}"], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    return set(json.loads(done.stdout.splitlines()[-1]))


def loaded(modules: set[str], names: tuple[str, ...]) -> set[str]:
    return {name for name in names if name in modules}


def test_import_loads_nothing_heavy() -> None:
    assert not loaded(modules_after("import organphys"), (*HEAVY, "numpy"))


def test_the_option_parser_loads_nothing_heavy() -> None:
    code = "from organphys.pipeline.command_line import build_parser; build_parser()"
    assert not loaded(modules_after(code), (*HEAVY, "numpy"))


def test_public_names_exist() -> None:
    modules_after("import organphys\nfor name in organphys.__all__: getattr(organphys, name)")


def test_the_table_of_public_names_is_whole() -> None:
    modules_after("import organphys\nassert set(organphys.__all__) == set(organphys._HOME)")


def test_default_method_needs_no_torch_and_no_rendering(tmp_path: Path) -> None:
    code = (
        "from organphys.pipeline.command_line import main\n"
        f"assert main(['demo', '--size', 'small', '--quiet', '--out', {str(tmp_path / 'demo')!r}]) == 0"
    )
    modules = modules_after(code)
    assert not loaded(modules, ("torch", "warp"))
    assert not {name for name in modules if "vtkRendering" in name}
    assert "vtk" not in modules  # the package that loads every VTK module, rendering too
