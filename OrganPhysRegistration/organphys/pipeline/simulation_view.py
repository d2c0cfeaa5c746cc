"""Pictures of a simulation as it goes: a strip of a few moments, and all frames of a video if one is wanted."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.special import expit

from ..exports.picture_sheet import Picture
from ..exports.simulation_pictures import Stage, stages
from ..exports.splat_frames import FollowingSplat
from ..exports.vtk_pictures import VtkStage
from ..ground.checks import Array
from ..points.gaussians import colour_from_sh
from ..simulation.organ_body import metres_per_unit
from ..simulation.psm_meshes import psm_meshes
from .simulated_organ import camera_of
from .simulation_plan import SimulationPlan
from .simulation_run import Step

MOMENTS = 6  # pictures of a strip
VIDEO_FPS = 30.0
VIEWS = ("from the camera", "from beside")
SHOWN_M = 0.05  # round the place where the tool comes nearest
SHOWN = 0.1  # opacity from which a Gaussian is drawn


class SimulationView:
    """Draws the moments it is shown; ``splat``: what follows the organ, if anything; renderer "software" or "vtk"."""

    def __init__(
        self, plan: SimulationPlan, splat: FollowingSplat | None, *, video: bool = False, renderer: str = "software"
    ) -> None:
        self._plan, self._splat = plan, splat
        self._unit = metres_per_unit(plan.organ)
        self._shown = np.zeros(0, dtype=np.int64)
        colours = np.zeros((0, 3))
        if splat is not None:
            gaussians = splat.gaussians
            opaque = expit(gaussians.opacity_logits.astype(np.float64)) > SHOWN
            self._shown = np.flatnonzero(gaussians.valid & opaque)
            colours = colour_from_sh(gaussians.sh_dc[self._shown]).astype(np.float64)
        body = plan.scene.bodies[0]
        rest = body.samples.vertices / self._unit
        drawn = stages(
            rest,
            body.samples.faces,
            near_tool(body.samples.vertices, plan) / self._unit,
            camera=camera_of(plan.organ),
            centres=self._centres(None),
            colours=colours,
        )
        self._stages: list[Stage | VtkStage] = list(drawn)
        if renderer == "vtk":
            self._stages = [VtkStage(stage) for stage in drawn]
        last = len(plan.poses) - 1
        self._wanted = set(np.linspace(0, last, min(MOMENTS, last + 1)).round().astype(int).tolist())
        self._every = max(1, round(1 / (VIDEO_FPS * plan.dt))) if video else 0
        self.rows: list[list[Picture]] = [[] for _ in self._stages]
        self.video: list[NDArray[np.uint8]] = []

    @property
    def video_fps(self) -> float:
        """Frames per second of the video, which runs in real time."""
        return 1 / (self._plan.dt * max(self._every, 1))

    def watch(self, step: Step) -> None:
        """Draw this moment if it belongs to the strip or the video."""
        filmed = bool(self._every) and step.number % self._every == 0
        if step.number not in self._wanted and not filmed:
            return
        vertices, centres, tools = self._at(step)
        if step.number in self._wanted:
            words = caption(step)
            for row, stage, view in zip(self.rows, self._stages, VIEWS, strict=True):
                text = words if row is self.rows[0] else view * (not row)
                row.append((text, stage.picture(vertices, centres, tools)))
        if filmed:
            self.video.append(self._beside_each_other(vertices, centres, tools))

    def _at(self, step: Step) -> tuple[Array, Array, list[tuple[Array, NDArray[np.int64]]]]:
        """Organ vertices, splat centres and tool solids in scene units."""
        state, body = step.moment.state, step.moment.scene.bodies[0]
        vertices = body.vertices(state.bodies[0].z) / self._unit
        meshes = psm_meshes(self._plan.psm.instrument, state.tools[0], self._plan.psm.rcm)
        tools = [(mesh.vertices / self._unit, mesh.triangles) for mesh in meshes if mesh.name != "trocar"]
        return vertices, self._centres(step), tools

    def _centres(self, step: Step | None) -> Array:
        if self._splat is None:
            return np.zeros((0, 3))
        centres = self._splat.gaussians.means.astype(np.float64)
        if step is not None:
            body, z = step.moment.scene.bodies[0], step.moment.state.bodies[0].z
            binding = self._splat.binding(step.moment)
            centres[binding.index] += binding.motion(body, z)[0]
        return centres[self._shown]

    def _beside_each_other(self, vertices: Array, centres: Array, tools: list) -> NDArray[np.uint8]:
        return np.concatenate([stage.picture(vertices, centres, tools) for stage in self._stages], axis=1)


def near_tool(vertices: Array, plan: SimulationPlan) -> Array:
    """Those of the vertices (Nv, 3) m that the pictures hold: round where the tool comes, all of a small organ."""
    places = np.array([pose.position for pose in plan.poses])
    gap, nearest = cKDTree(vertices).query(places)
    around: Array = vertices[np.linalg.norm(vertices - vertices[nearest[gap.argmin()]], axis=1) < SHOWN_M]
    return around


def caption(step: Step) -> str:
    """Time, and force on the tool."""
    time = f"{step.moment.state.time:.2f} s"
    if step.report is None:
        return time
    return f"{time}, {np.linalg.norm(step.report.forces[0].force):.1f} N on the tool"
