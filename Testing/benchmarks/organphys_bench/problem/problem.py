"""One registration problem: the same inputs and the same start for every method."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from organphys.ground.frames import Similarity
from organphys.ground.progress import no_progress
from organphys.pipeline.case import Case
from organphys.pipeline.default_method import DefaultMethod
from organphys.pipeline.registration import RegisterOptions
from organphys.points.point_sets import Box, Camera, GaussianCloud, Landmarks, Organ

if TYPE_CHECKING:
    from case_inputs import CaseInputs


@dataclass(frozen=True)
class Problem:
    """organ (RAS mm) and splat (raw scene units) with what a user states; no truth. ``seed``: of all that is random."""

    organ: Organ
    splat: GaussianCloud
    landmarks: Landmarks | None
    box: Box | None
    camera: Camera
    seed: int = 0

    @classmethod
    def of(cls, inputs: CaseInputs, *, seed: int = 0) -> Problem:
        """A case folder's inputs without its truth."""
        return cls(inputs.organ, inputs.splat, inputs.landmarks, inputs.box, inputs.camera, seed)

    def options(self, **settings: str) -> RegisterOptions:
        return RegisterOptions(seed=self.seed, **settings)

    @cached_property
    def case(self) -> Case:
        """The inputs as OrganPhys's stages get them: opaque Gaussians in the crop box, and 5000 of them as target."""
        return Case.of(
            self.organ, self.splat, self.options(), landmarks=self.landmarks, camera=self.camera, box=self.box
        )

    @cached_property
    def method(self) -> DefaultMethod:
        """OrganPhys's own stages for this case: surface samples and the view of the splat."""
        return DefaultMethod(self.case)

    @cached_property
    def start(self) -> Similarity:
        """T_scene_ct where every peer begins: the best pose of OrganPhys's global search, landmarks used.

        More than a peer's own literature asks for (a rough alignment by hand): pose and scale are nearly right.
        """
        return self.method.coarse(no_progress).T_scene_ct
