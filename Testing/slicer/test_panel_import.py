"""The module opens in a Slicer that has none of the packages yet which are installed at first use."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
PROGRAM = """
import os, sys
sys.path.insert(0, {here!r})
MISSING = {{"scipy", "SimpleITK", "plyfile", "threadpoolctl", "matplotlib", "PIL", "torch"}}

class Missing:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in MISSING:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)

sys.meta_path.insert(0, Missing())
import host
running = host.start()
module = running.load({module!r})
running.process()
ui = module.ui
ui.opacitySlider.value = 0.3
running.process()
assert not running.record.errors, running.record.errors
assert not set(sys.modules) & MISSING, set(sys.modules) & MISSING
print("reason:", ui.reasonLabel.text, flush=True)
os._exit(0)
"""


def test_panel_opens_without_the_packages_installed_at_first_use():
    module = HERE.parents[1] / "OrganPhysRegistration" / "OrganPhysRegistration.py"
    program = PROGRAM.format(here=str(HERE), module=str(module))
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    assert "segmentation" in done.stdout
