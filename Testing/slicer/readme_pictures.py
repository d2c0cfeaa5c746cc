"""Makes the extension's screenshots on the test host: ``python Testing/slicer/readme_pictures.py [FOLDER]``.

FOLDER (default Resources) gets panel.png, the panel beside the overlay from the endoscope and from the side, and
overlay.png. The run is the sample case in full size, from the panel, on a machine that should have nothing else to do.
"""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

import host as slicer_host

ROOT = Path(__file__).resolve().parents[2]
MODULE = ROOT / "OrganPhysRegistration" / "OrganPhysRegistration.py"
VIEW_WIDTH, SIDE_DEG = 600, 50
TOP, BOTTOM = (0.16, 0.18, 0.24), (0.07, 0.08, 0.11)


def register_sample(host, module) -> None:
    """Press the panel's Register and wait for the result."""
    with tempfile.TemporaryDirectory() as folder:
        module.widget.panel.choose(module.logic.loadSampleCase(folder=folder))
        host.process()
        module.ui.applyButton.click()
        host.wait_until(lambda: module.ui.applyButton.text == "Register", 300)
    host.wait(1.0)


def draw(view, size: tuple[int, int]) -> Image.Image:
    view.window.SetSize(*size)
    view.node.SetBoxVisible(False)
    view.node.SetAxisLabelsVisible(False)
    view.node.SetBackgroundColor(BOTTOM)
    view.node.SetBackgroundColor2(TOP)
    with tempfile.TemporaryDirectory() as folder:
        view.png(Path(folder) / "view.png")
        return Image.open(Path(folder) / "view.png").convert("RGB")


def main(folder: Path) -> None:
    host = slicer_host.start()
    module = host.load(MODULE)
    register_sample(host, module)
    host.screenshot(module.panel, folder / "panel.png")
    panel = Image.open(folder / "panel.png").convert("RGB")

    view = host.app.layoutManager().threeDWidget(0).view
    size = (VIEW_WIDTH, panel.height // 2)
    view.window.SetSize(*size)
    module.ui.endoscopeViewButton.click()
    host.process()
    front = draw(view, size)
    view.camera_node().GetCamera().Azimuth(SIDE_DEG)
    view.camera_node().GetCamera().Dolly(0.75)
    view.renderer.ResetCameraClippingRange()
    side = draw(view, size)

    sheet = Image.new("RGB", (panel.width + VIEW_WIDTH, panel.height), tuple(int(255 * c) for c in BOTTOM))
    for picture, place in ((panel, (0, 0)), (front, (panel.width, 0)), (side, (panel.width, size[1]))):
        sheet.paste(picture, place)
    sheet.save(folder / "panel.png", optimize=True)
    front.save(folder / "overlay.png", optimize=True)
    print(f"{folder}: {module.ui.messageLabel.text} ({np.asarray(sheet).shape[1]} px wide)", flush=True)
    module.logic.cleanup()
    host.remove_files()
    os._exit(0)  # Qt's and VTK's teardown may crash


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "Resources").resolve())
