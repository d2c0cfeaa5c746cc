"""Makes the extension's screenshot of the simulation: ``python Testing/slicer/simulation_picture.py [FOLDER]``.

FOLDER (default Resources) gets simulation.png: the panel beside the sample liver, grasped and lifted, as Gaussians and
as a surface coloured by its displacement. Prints how long the way there took and how long the event loop stood still.
"""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

import readme_pictures
from PIL import Image

import host as slicer_host

MODULE = readme_pictures.ROOT / "OrganPhysSimulation" / "OrganPhysSimulation.py"
TIMEOUT = 600  # seconds
SIZE = (620, 500)
LIFT_MM = 18.0


def prepared(host, module) -> None:
    """Press Sample data and Start."""
    ui, logic = module.ui, module.logic
    for button, done in (
        (ui.sampleDataButton, lambda: ui.startButton.enabled),
        (ui.startButton, lambda: logic.running),
    ):
        began, name = time.perf_counter(), button.text
        with host.latency_meter() as meter:
            button.click()
            host.wait_until(done, TIMEOUT)
        report(name, began, meter)


def grasp_and_lift(host, module) -> None:
    """Insert, close, lift, by the sliders."""
    ui, logic = module.ui, module.logic
    live = logic.session.live
    away = ui.insertionSlider.value
    began = time.perf_counter()
    with host.latency_meter() as meter:
        ui.jawSlider.value = 50
        ui.insertionSlider.value = 1e3 * live.joints_at_contact(depth=0.010)[2]
        host.wait_until(lambda: reached(live), TIMEOUT)
        ui.jawButton.click()
        host.wait_until(lambda: reached(live), TIMEOUT)
        ui.insertionSlider.value = max(away, ui.insertionSlider.value - LIFT_MM)
        host.wait_until(lambda: reached(live), TIMEOUT)
    report(
        f"grasp and lift ({live.time_s:.2f} s simulated, last step {live.readings.last.step_ms:.0f} ms)", began, meter
    )


def reached(live) -> bool:
    """Whether the arm is where the sliders want it."""
    return abs(live.arm.joints - live.wanted.joints).max() < 1e-6 and abs(live.arm.jaw_deg - live.wanted.jaw_deg) < 1e-3


def report(what: str, began: float, meter) -> None:
    print(f"{what}: {time.perf_counter() - began:.1f} s, longest block {1e3 * meter.longest:.0f} ms", flush=True)


def main(folder: Path) -> None:
    host = slicer_host.start()
    module = host.load(MODULE)
    prepared(host, module)
    grasp_and_lift(host, module)
    panel_path = folder / "simulation.png"
    host.screenshot(module.panel, panel_path)
    panel = Image.open(panel_path).convert("RGB")
    module.ui.startButton.click()
    parameters, view = module.widget.panel.parameters, slicer_host.running().app.layoutManager().threeDWidget(0).view
    parameters.showHandle = False
    parameters.pins.SetDisplayVisibility(False)
    view.window.SetSize(*SIZE)
    module.ui.endoscopeViewButton.click()
    host.process()
    splat = readme_pictures.draw(view, SIZE)
    parameters.showSplat = False
    from OrganPhysSimulationLib.choices import Colouring

    parameters.colouring = Colouring.Displacement
    host.process()
    coloured = readme_pictures.draw(view, SIZE)
    height = max(panel.height, 2 * SIZE[1])
    sheet = Image.new("RGB", (panel.width + SIZE[0], height), tuple(int(255 * c) for c in readme_pictures.BOTTOM))
    sheet.paste(panel, (0, 0))
    sheet.paste(splat, (panel.width, 0))
    sheet.paste(coloured, (panel.width, SIZE[1]))
    sheet.save(panel_path, optimize=True)
    print(f"{panel_path}: {host.record.errors or 'no errors'}", flush=True)
    module.logic.cleanup()
    host.remove_files()
    os._exit(0)  # Qt's and VTK's teardown may crash


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else readme_pictures.ROOT / "Resources").resolve())
