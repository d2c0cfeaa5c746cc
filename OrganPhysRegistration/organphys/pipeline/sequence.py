"""Follows one organ through the splats of a sequence: the first frame in full, the others by warm start."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any

import numpy as np

from ..align.splat_view import SplatView
from ..asset.organ_sequence import OrganSequence
from ..elastic.elastic_registration import ElasticOptions, ElasticState
from ..ground.checks import Array, InputError
from ..ground.frames import Similarity
from ..ground.progress import Progress, no_progress
from ..points.point_sets import Box, Camera, GaussianCloud, Landmarks, Organ, SceneUnit
from .case import Case
from .default_method import DefaultMethod
from .frame_view import Near, frame_view
from .motion_ahead import moved_on
from .organ_in_scene import organ_in_scene
from .processor import one_blas_thread
from .registration import RegisterOptions, Registration
from .session import RegistrationSession
from .tracking import Fit, FollowOptions, follow_on, is_lost, judged, state_of


@dataclass(frozen=True)
class Frame:
    """One frame done. T_scene_ct and z (4H, 3) as in ``ElasticResult``; status: see ``OrganSequence``; ``lost``: why it
    was, "" if it was not; seconds: spent on it, reading the file not included."""

    time: float
    T_scene_ct: Similarity
    z: Array
    fit: Fit
    status: str
    lost: str
    seconds: float


class SequenceFollower:
    """``add`` one splat after the other; ``sequence`` is what was found. InputError for what cannot be used."""

    def __init__(
        self,
        organ: Organ,
        options: RegisterOptions | None = None,
        *,
        follow: FollowOptions | None = None,
        landmarks: Landmarks | None = None,
        camera: Camera | None = None,
        box: Box | None = None,
        unit: SceneUnit | None = None,
        provenance: Mapping[str, Any] | None = None,
    ) -> None:
        """Arguments as of ``register``; all frames share camera, box and unit, the landmarks serve the first."""
        self.organ, self.options, self.follow = organ, options or RegisterOptions(), follow or FollowOptions()
        if self.options.method != "organphys":
            raise InputError("sequence: only the method organphys follows an organ; leave --method out")
        self.camera, self.box, self.unit = camera or Camera(), box, unit
        self._first: dict[str, Any] = {"landmarks": landmarks, "unit": unit, "provenance": provenance}
        self.frames: list[Frame] = []
        self.registration: Registration | None = None

    @one_blas_thread
    def add(self, splat: GaussianCloud, time: float, progress: Progress = no_progress) -> Frame:
        """The organ in the next frame; ``time`` later than the last one's."""
        if self.frames and not time > self.frames[-1].time:
            raise InputError(f"sequence: time {time:g} does not come after {self.frames[-1].time:g}; sort the frames")
        begin = perf_counter()
        frame = self._next(splat, time, progress) if self.frames else self._begin(splat, time, progress)
        self.frames.append(replace(frame, seconds=perf_counter() - begin))
        return self.frames[-1]

    @property
    def sequence(self) -> OrganSequence:
        """What was found so far, times in seconds."""
        return self.sequence_with()

    def sequence_with(self, *, time_unit: str = "s", figures: Mapping[str, Array] | None = None) -> OrganSequence:
        """The same with times in another unit ("frame") and further ``figures``, one number per frame."""
        if self.registration is None:
            raise InputError("sequence: no frame was added yet")
        frames, poses = self.frames, [frame.T_scene_ct for frame in self.frames]
        return OrganSequence(
            organ=self.registration.organ,
            times=np.array([frame.time for frame in frames]),
            z=np.stack([frame.z for frame in frames]),
            scales=np.array([pose.scale for pose in poses]),
            rotations=np.stack([pose.rotation for pose in poses]),
            translations=np.stack([pose.translation for pose in poses]),
            status=tuple(frame.status for frame in frames),
            time_unit=time_unit,
            figures={
                "splat_to_organ_trim30_mm": np.array([frame.fit.distance_mm for frame in frames]),
                "score": np.array([frame.fit.score for frame in frames]),
                "seen_percent": np.array([100 * frame.fit.seen_share for frame in frames]),
                "seconds": np.array([frame.seconds for frame in frames]),
                **(figures or {}),
            },
            notices=tuple((k, _told(frame)) for k, frame in enumerate(frames) if frame.lost),
        )

    def _begin(self, splat: GaussianCloud, time: float, progress: Progress) -> Frame:
        session = RegistrationSession(
            self.organ, splat, self.options, camera=self.camera, box=self.box, progress=progress, **self._first
        )
        session.advance("elastic", progress)
        self.registration = session.registration
        method = session.default_method
        self._method, self._base = method, ElasticOptions.stiffness(self.options.stiffness)
        result = session.state.stages["elastic"].result
        state = state_of(result.z, method.camera_pose(result.T_scene_ct))
        self._cluttered = any(notice.code == "organ_found_in_scene" for notice in session.state.case.notices)
        return self._frame(method.view, judged(method.organ, method.view, state), time, "first", "")

    def _next(self, splat: GaussianCloud, time: float, progress: Progress) -> Frame:
        good = [frame.fit for frame in self.frames if frame.status != "lost"]
        lost, fit, view = "", self.frames[-1].fit, self._method.view
        try:
            view = frame_view(splat, self.camera, self.box, self.options, self._near())
            fit = follow_on(self._method.organ, view, self._expected(view, time), self._base, self.follow)
            lost = is_lost(fit, good, self.follow)
        except InputError as error:
            return self._frame(view, replace(fit, state=self._seen_by(view)), time, "lost", str(error))
        status = "tracked"
        if lost and self.follow.restart:
            again = self._search(splat, view, progress)
            status = "lost" if is_lost(again, good, self.follow) else "restarted"
            fit = again if status == "restarted" else replace(fit, state=self._seen_by(view))
        return self._frame(view, fit, time, status, lost)

    def _search(self, splat: GaussianCloud, view: SplatView, progress: Progress) -> Fit:
        """The whole registration of one frame, at the scale known."""
        mm_per_unit = 1 / self.frames[-1].T_scene_ct.scale
        unit = SceneUnit(mm_per_unit, self.follow.scale_percent)
        case = Case.of(self.organ, splat, self.options, camera=self.camera, box=self.box, unit=unit)
        method = DefaultMethod(organ_in_scene(case, progress) if self._cluttered else case)
        vars(method).update({name: vars(self._method)[name] for name in ("samples", "organ")})
        if not self._cluttered:
            vars(method)["view"] = view
        coarse = method.coarse(progress)
        result = method.elastic(coarse, method.rigid(coarse, None, progress), None, progress).result
        return judged(method.organ, method.view, state_of(result.z, method.camera_pose(result.T_scene_ct)))

    def _near(self) -> Near | None:
        """Where to look for the organ, where the splat shows other tissue as well."""
        if not self._cluttered:
            return None
        return Near(self._state.pose.apply(self._method.organ.points(self._state.z)), self._state.pose.scale)

    def _seen_by(self, view: SplatView) -> ElasticState:
        """The last state in the camera frame of another view."""
        return _into(view.T_camera_scene, self._state)

    def _expected(self, view: SplatView, time: float) -> ElasticState:
        """The same, gone on as the organ moved, where that is known and turns nothing inside out."""
        if self._before is None or not self.follow.ahead:
            return self._seen_by(view)
        last, since = self.frames[-1].time, self.frames[-2].time
        share = self.follow.ahead * min((time - last) / (last - since), 1.0)
        state = moved_on(self._before, self._state, share)
        if self._method.organ.elasticity.min_det(state.z) <= 0:
            return self._seen_by(view)
        return _into(view.T_camera_scene, state)

    def _frame(self, view: SplatView, fit: Fit, time: float, status: str, lost: str) -> Frame:
        followed = status == "tracked" and self.frames[-1].status != "lost"
        self._before: ElasticState | None = self._state if followed else None
        self._state: ElasticState = _into(view.T_camera_scene.inverse(), fit.state)
        T_scene_ct = self._state.pose @ self._method.samples.normalisation.T_ct_normalised.inverse()
        return Frame(time, T_scene_ct, fit.state.z, fit, status, lost, 0.0)


def _into(T_other_frame: Similarity, state: ElasticState) -> ElasticState:
    """A state with gamma = 1 seen from another frame."""
    return ElasticState(state.z, 1.0, T_other_frame @ state.pose)


def _told(frame: Frame) -> str:
    done = {"restarted": "it was found again by a full search", "lost": "it lies as in the frame before"}
    return f"the organ was lost: {frame.lost}; {done.get(frame.status, 'the search was left out')}"
