"""Makes the tutorial's pictures on the test host: ``python Testing/slicer/tutorial_pictures.py [FOLDER]``.

FOLDER (default Resources/Docs/pictures) gets one picture per step that has one. All of them show the generated sample
case in full size. Views are drawn as Slicer draws them, panels as Qt draws them.
"""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path

import readme_pictures
import simulation_picture
from PIL import Image

import host as slicer_host

FOLDER = readme_pictures.ROOT / "Resources" / "Docs" / "pictures"
VIEW = (560, 430)
TIMEOUT = 600  # seconds
BACK_DEG = 160


def panel_picture(host, module, path: Path) -> None:
    host.process()
    host.screenshot(module.panel, path)
    Image.open(path).convert("RGB").quantize(256, dither=Image.Dither.NONE).save(path, optimize=True)


def side_by_side(images: list[Image.Image], path: Path) -> None:
    sheet = Image.new("RGB", (sum(i.width for i in images) + 4 * (len(images) - 1), images[0].height), "white")
    left = 0
    for image in images:
        sheet.paste(image, (left, 0))
        left += image.width + 4
    sheet.save(path, optimize=True)


def views(host, module, path: Path, turn_deg: float = readme_pictures.SIDE_DEG) -> None:
    """What the 3D view shows from the endoscope and turned about the vertical."""
    view = host.app.layoutManager().threeDWidget(0).view
    view.window.SetSize(*VIEW)
    module.ui.endoscopeViewButton.click()
    host.process()
    front = readme_pictures.draw(view, VIEW)
    view.camera_node().GetCamera().Azimuth(turn_deg)
    view.fit()
    side_by_side([front, readme_pictures.draw(view, VIEW)], path)


def organ_and_landmarks(host, nodes, path: Path) -> None:
    """The CT organ with its landmarks, seen from the front."""
    view = host.app.layoutManager().threeDWidget(0).view
    nodes["splat"].SetDisplayVisibility(False)
    nodes["landmarks"].GetDisplayNode().SetTextScale(4)
    view.window.SetSize(*VIEW)
    view.fit()
    camera = view.camera_node().GetCamera()
    camera.SetViewUp(0, 0, 1)
    view.fit()
    readme_pictures.draw(view, VIEW).save(path, optimize=True)
    nodes["splat"].SetDisplayVisibility(True)


def registration(host, module, folder: Path) -> None:
    """Steps 1 to 8: from the empty panel to a registered organ that has taken the tumour along."""
    from OrganPhysRegistrationLib.choices import SurfaceColour

    ui, panel = module.ui, module.widget.panel
    panel_picture(host, module, folder / "panel_empty.png")
    with tempfile.TemporaryDirectory() as cache:
        nodes = module.logic.loadSampleCase(folder=cache)
        organ_and_landmarks(host, nodes, folder / "organ.png")
        panel.choose(nodes)
        panel_picture(host, module, folder / "panel_inputs.png")
        for node in (nodes["segmentation"], nodes["landmarks"]):
            node.SetDisplayVisibility(False)
        views(host, module, folder / "splat.png")
        ui.applyButton.click()
        host.wait_until(lambda: ui.progressBar.visible and ui.progressBar.value > 40, TIMEOUT)
        panel_picture(host, module, folder / "panel_running.png")
        host.wait_until(lambda: ui.applyButton.text == "Register", TIMEOUT)
    host.wait(1.0)
    panel_picture(host, module, folder / "panel_result.png")
    views(host, module, folder / "overlay.png")
    panel.choose({"surfaceColour": SurfaceColour.Error95})
    host.process()
    for node in (nodes["splat"], nodes["segmentation"], nodes["landmarks"]):
        node.SetDisplayVisibility(False)
    views(host, module, folder / "confidence.png", BACK_DEG)
    neighbour(host, module, nodes, folder / "neighbour.png")


def neighbour(host, module, nodes, path: Path) -> None:
    """The gallbladder, carried along, through the translucent liver."""
    from OrganPhysRegistrationLib.outputs.surface_colours import legend_of

    case, segments = module.widget.panel.case(), nodes["segmentation"].GetSegmentation()
    (gallbladder,) = [i for i in segments.GetSegmentIDs() if segments.GetSegment(i).GetName() == "gallbladder"]
    module.logic.applyTransformToSegment(case, nodes["segmentation"], gallbladder)
    surface = case.node("surface_elastic")
    legend_of(surface).SetVisibility(False)
    display = surface.GetDisplayNode()
    display.SetScalarVisibility(False)
    display.SetColor(0.72, 0.33, 0.28)
    display.SetOpacity(0.45)
    views(host, module, path)


def simulation(host, folder: Path) -> None:
    """Steps 9 and 10: the sample organ grasped and lifted."""
    module = host.load(simulation_picture.MODULE)
    simulation_picture.prepared(host, module)
    simulation_picture.grasp_and_lift(host, module)
    panel_picture(host, module, folder / "panel_simulation.png")
    module.ui.startButton.click()
    from OrganPhysSimulationLib.choices import Colouring

    parameters = module.widget.panel.parameters
    parameters.showHandle = False
    parameters.pins.SetDisplayVisibility(False)
    view = host.app.layoutManager().threeDWidget(0).view
    view.window.SetSize(*VIEW)
    module.ui.endoscopeViewButton.click()
    host.process()
    splat = readme_pictures.draw(view, VIEW)
    parameters.showSplat, parameters.colouring = False, Colouring.Displacement
    host.process()
    side_by_side([splat, readme_pictures.draw(view, VIEW)], folder / "lifted.png")
    module.logic.cleanup()


def main(folder: Path, parts: list[str]) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    host = slicer_host.start()
    if "registration" in parts:
        module = host.load(readme_pictures.MODULE)
        registration(host, module, folder)
        module.logic.cleanup()
        host.clear_scene()
    if "simulation" in parts:
        simulation(host, folder)
    print(f"{folder}: {host.record.errors or 'no errors'}", flush=True)
    host.remove_files()
    os._exit(0)  # Qt's and VTK's teardown may crash


if __name__ == "__main__":
    given = [part for part in sys.argv[1:] if part in ("registration", "simulation")]
    folders = [part for part in sys.argv[1:] if part not in given]
    main(Path(folders[0] if folders else FOLDER).resolve(), given or ["registration", "simulation"])
