"""What the coarse stage found, for the report and the JSON."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..ground.checks import Array


@dataclass(frozen=True)
class CoarseView:
    """How the organ was turned towards the camera (the paper's Figures 4 to 6).

    front_ct (3,) unit: CT organ centroid to its visible side; viewer_scene (3,) unit: towards the camera;
    hull_segment_ct (2, 3) mm: farthest pair of the organ's silhouette along the front, hull_diameter_mm apart;
    box_extent_scene: longest edge of the splat's oriented box in scene units, box_corners_scene (8, 3);
    twists_deg (K,) tried about the viewing axis, twist_costs (K,) in the unit that twist_cost_name tells.
    """

    front_ct: Array
    viewer_scene: Array
    hull_segment_ct: Array
    hull_diameter_mm: float
    box_extent_scene: float
    box_corners_scene: Array
    twists_deg: Array
    twist_costs: Array
    twist_cost_name: str
    chosen_twist_deg: float

    @property
    def margin(self) -> float:
        """How much worse the second best twist is, as a fraction of the best cost (0.05: within 5 percent)."""
        if len(self.twist_costs) < 2:
            return float("inf")
        best, second = np.partition(self.twist_costs, 1)[:2]
        return float(second / best - 1) if best > 0 else float("inf")
