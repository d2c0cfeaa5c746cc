"""A trajectory as the arm follows it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from organphys.asset.registered_organ import RegisteredOrgan
from organphys.ground.frames import Similarity
from organphys.points.trajectory import Trajectory
from organphys.simulation.organ_body import metres_per_unit
from organphys.simulation.psm import Psm
from organphys.simulation.state import ToolPose


@dataclass(frozen=True)
class ToolPath:
    """A trajectory in the simulation's metres; ``began_s``: simulated time of its first pose."""

    trajectory: Trajectory
    began_s: float

    @classmethod
    def of(cls, trajectory: Trajectory, organ: RegisteredOrgan, began_s: float) -> ToolPath:
        """From any frame of a trajectory file."""
        unit = metres_per_unit(organ)
        scaled = np.diag([unit, unit, unit, 1.0])
        T_sim_scene = Similarity.of_matrix(scaled)
        T_sim_ct = Similarity.of_matrix(scaled @ organ.T_scene_ct.matrix)
        return cls(trajectory.in_metres(T_sim_scene, T_sim_ct), began_s)

    def over(self, time_s: float) -> bool:
        """Whether the last pose has passed."""
        return time_s - self.began_s > self.trajectory.duration

    def at(self, time_s: float, psm: Psm) -> ToolPose:
        """The pose of the tool, whose origin is at the hinge, for the trajectory's tip."""
        tip = self.trajectory.at(float(self.trajectory.times[0]) + time_s - self.began_s)
        hinge = tip.position - psm.instrument.jaw_length * tip.rotation[:, 2]
        return ToolPose(hinge, tip.rotation, tip.jaw_deg)
