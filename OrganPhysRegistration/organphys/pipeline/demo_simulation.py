"""The end of the demo: its organ is grasped and lifted, and the splat follows."""

from __future__ import annotations

from pathlib import Path

from ..asset.registered_organ import RegisteredOrgan
from ..exports.picture_sheet import Picture
from ..exports.report_content import PictureStrip
from ..exports.splat_frames import FollowingSplat
from ..ground.progress import Progress
from ..readers.gaussian_ply import read_gaussians
from ..simulation.local_detail import LocalDetail
from ..simulation.options import SimulationOptions
from ..simulation.organ_body import metres_per_unit, organ_body
from .commands_simulate import arm_over
from .default_grasp import default_grasp, far_side_pin
from .simulated_organ import camera_of
from .simulation_plan import simulation_plan
from .simulation_run import run_plan
from .simulation_view import SimulationView

HANDLES, QUADRATURE, FPS = 12, 600, 30.0  # fewer than usual: the demo should not take long
NOTE = (
    "The registered organ as simulated, held at its far side: a large needle driver grasps it and lifts it along the "
    "surface, and the Gaussians follow the tissue. Upper row from the camera, lower row from beside; grey is the tool, "
    "faint where tissue hides it, flat pink is the organ where the splat shows nothing."
)


def demo_grasp(organ: RegisteredOrgan, splat: Path, progress: Progress) -> tuple[list[list[Picture]], PictureStrip]:
    """Rows of pictures from the camera and from beside, and the same as a strip of the report."""
    progress("build the reduced model", 0.0)
    unit = metres_per_unit(organ)
    camera = camera_of(organ) * unit
    body = organ_body(organ, pins=(far_side_pin(organ, camera),), handles=HANDLES, quadrature=QUADRATURE)
    psm = arm_over(body, "large_needle_driver", camera)
    trajectory = default_grasp(body, camera, psm.rcm)
    plan = simulation_plan(organ, body, psm, trajectory, fps=FPS, options=SimulationOptions(), detail=LocalDetail())
    view = SimulationView(plan, FollowingSplat(read_gaussians(splat), body, unit))
    run_plan(plan, view.watch, progress=progress)
    pictures = [(text, image) for row in view.rows for text, image in row]
    return view.rows, PictureStrip("Grasped and lifted", pictures, NOTE)
