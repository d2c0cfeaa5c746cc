"""OrganPhysRegistrationLogic: the module without its panel, for the Python console, scripts and tests.

Inputs are nodes or plain values, results are returned. Lengths are in mm, scene units are the splat's own. What is
wrong with an input is an ``InputError`` whose message says what to do.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import slicer
from slicer.ScriptedLoadableModule import ScriptedLoadableModuleLogic

from organphys.ground.checks import InputError
from organphys.ground.progress import Progress, no_progress

from .dependencies import ensure_packages
from .inputs.camera_input import camera_from_view
from .inputs.sample_case import load_sample_case
from .inputs.splat_landmarks import keep_on_splat
from .inputs.splat_node import load_splat
from .outputs.apply_transform import apply_to
from .outputs.case_record import CaseNodes
from .outputs.sequence_nodes import SequenceNodes
from .runs.blocking_run import outcome_of_inputs
from .runs.core_in_use import CoreInUse, core_in_use, log_core_in_use
from .runs.exports import export_case
from .runs.input_problems import problems_of, problems_of_parameters
from .runs.live_updates import LiveCallbacks, LiveUpdates
from .runs.registration_run import RegistrationRun
from .runs.result_nodes import write_case
from .runs.run_callbacks import RunCallbacks, nothing
from .runs.run_inputs import RunInputs, inputs_from_parameters
from .runs.run_manager import BUSY, RunManager
from .runs.run_process import RunProcess
from .runs.segment_copy import copy_segment
from .runs.sequence_run import SequenceCallbacks, SequenceRun

STAGES = ("coarse", "rigid", "elastic")
STAGE_RUNS = tuple(STAGES[first:end] for first in range(3) for end in range(first + 1, 4))


class OrganPhysRegistrationLogic(ScriptedLoadableModuleLogic):
    """``process``: the registration process, for tests."""

    def __init__(self, parent: Any = None, *, process: RunProcess | None = None) -> None:
        ScriptedLoadableModuleLogic.__init__(self, parent)
        self.moduleName = "OrganPhysRegistration"  # the parameter node carries it, whatever the class is called
        self._runs = RunManager(process)
        log_core_in_use()

    def organphysInUse(self) -> CoreInUse:
        """Version and file of the imported core package; ``warning`` if another copy shadows the module's own."""
        return core_in_use()

    # inputs

    def loadSplat(self, path: str | Path, *, mmPerUnit: float | None = None, mmPerUnitPercent: float = 0.0) -> Any:
        """Load a Gaussian splat (.ply) as a model node beside the CT.

        mmPerUnit: mm per scene unit if known, mmPerUnitPercent its standard deviation in percent (0: exact). InputError
        for a file that is not a splat.
        """
        ensure_packages()
        return load_splat(path, mm_per_unit=mmPerUnit, percent=mmPerUnitPercent)

    def loadSampleCase(self, *, folder: str | Path | None = None, size: str = "full") -> dict[str, Any]:
        """Make (once, a few seconds) and load the sample case: segmentation, segmentID, splat, landmarks."""
        ensure_packages()
        nodes = load_sample_case(folder=folder, size=size)
        return {
            "segmentation": nodes.segmentation,
            "segmentID": nodes.segment_id,
            "splat": nodes.splat,
            "landmarks": nodes.landmarks,
        }

    def cameraFromView(self, splatNode: Any, view: Any = None) -> tuple[Any, float]:
        """Position (3,) in scene units and field of view in degrees (0: not known) of a 3D view (default the first)."""
        if view is None:
            view = slicer.app.layoutManager().threeDWidget(0).mrmlViewNode()
        return camera_from_view(splatNode, view)

    def problems(self, parameters: Any) -> list[str]:
        """Why a run cannot start now, in plain words, the most important first; [] if it can.

        parameters: OrganPhysRegistrationParameterNode, any object with its names, or RunInputs.
        """
        busy = [BUSY] if self._runs.busy else []
        found = problems_of(parameters) if isinstance(parameters, RunInputs) else problems_of_parameters(parameters)
        return [*busy, *found]

    # registration

    def register(
        self,
        segmentationNode: Any,
        segmentID: str,
        splatNode: Any,
        *,
        landmarksNode: Any = None,
        splatLandmarksNode: Any = None,
        camera: Sequence[float] | None = None,
        cameraFovDeg: float | None = None,
        roiNode: Any = None,
        mmPerUnit: float | None = None,
        mmPerUnitPercent: float = 0.0,
        stages: Sequence[str] = STAGES,
        start: Any = None,
        progress: Progress = no_progress,
        **options: Any,
    ) -> CaseNodes:
        """Register in this process and wait for the result: the case's nodes, transforms included.

        segmentID: the organ's segment; landmarksNode: 1-2 points on the organ where the endoscope sees it;
        splatLandmarksNode: the same points on the shown splat, matched by label, else by order; camera (3,): endoscope
        in scene units, default the scene's origin; cameraFovDeg: full angle, degrees; roiNode: crop of the splat;
        mmPerUnit, mmPerUnitPercent: mm per scene unit and its standard deviation in percent (0: exact); stages: the
        last one is the one to reach; start (4, 4): T_scene_ct set by hand for the first of them; progress(stage,
        fraction): raise organphys.Cancelled in it to stop, the scene is unchanged then. options: method "organphys" |
        "paper", stiffness "conservative" | "moderate" | "aggressive" or a number from 0.001 (soft) to 0.2, weights
        "rkpm" | "learned", opacity (0..1), remove_floaters, close_holes, opening, seed, landmark_radius_mm.
        """
        inputs = RunInputs(
            segmentation=segmentationNode,
            segment_id=segmentID,
            splat=splatNode,
            landmarks=landmarksNode,
            splat_landmarks=splatLandmarksNode,
            roi=roiNode,
            camera_position=None if camera is None else tuple(float(x) for x in camera),
            camera_fov_deg=cameraFovDeg,
            mm_per_unit=mmPerUnit,
            unit_percent=mmPerUnitPercent,
            **options,
        )
        self._check(inputs, stages)
        keep_on_splat(inputs.splat_landmarks, inputs.splat)
        written = write_case(outcome_of_inputs(inputs, stages, start, progress), inputs)
        self._runs.remember(written.case, written.undo)
        return written.case

    def startRun(
        self,
        parameters: Any,
        stages: Sequence[str] = STAGES,
        *,
        start: Any = None,
        onProgress: Callable[[str, float], None] = nothing,
        onSurface: Callable[[Any], None] = nothing,
        onDone: Callable[[CaseNodes], None] = nothing,
        onTransform: Callable[[CaseNodes], None] = nothing,
        onFailed: Callable[[str, str], None] = nothing,
    ) -> RegistrationRun | None:
        """Register in the background; returns at once. What is called when: see runs/run_callbacks.py.

        parameters: OrganPhysRegistrationParameterNode or RunInputs; stages, start: as in ``register``. None if it
        cannot start: ``onFailed("input", reason)`` has been called then.
        """
        callbacks = RunCallbacks(onProgress, onSurface, onDone, onTransform, onFailed)
        try:
            inputs = parameters if isinstance(parameters, RunInputs) else inputs_from_parameters(parameters)
            self._check(inputs, stages)
            keep_on_splat(inputs.splat_landmarks, inputs.splat)
            return self._runs.start(inputs, stages, callbacks, start=start)
        except InputError as error:
            onFailed("input", str(error))
            return None

    def startLiveUpdate(
        self,
        parameters: Any,
        *,
        onUpdated: Callable[[CaseNodes, float], None] = nothing,
        onSettled: Callable[[CaseNodes], None] = nothing,
        onFailed: Callable[[str], None] = nothing,
        onEnded: Callable[[str], None] = nothing,
    ) -> LiveUpdates:
        """From now on a moved landmark, or ``set_stiffness`` of the returned object, registers again in the background
        (about a second) and moves the surface; inner points, transforms and tables follow once all is still.

        The organ must have been registered with these parameters by ``startRun`` (InputError). ``stopLiveUpdate``, a
        run and an undo end it. onUpdated(case, seconds), onSettled(case), onFailed(message), onEnded(message).
        """
        inputs = parameters if isinstance(parameters, RunInputs) else inputs_from_parameters(parameters)
        return self._runs.start_live(inputs, LiveCallbacks(onUpdated, onSettled, onFailed, onEnded))

    def stopLiveUpdate(self) -> None:
        """End live updates, if they are on; what they did can be undone as one run."""
        self._runs.stop_live()

    def followSequence(
        self,
        parameters: Any,
        splats: str | Path,
        *,
        fps: float | None = None,
        onProgress: Callable[[float], None] = nothing,
        onDone: Callable[[SequenceNodes], None] = nothing,
        onFailed: Callable[[str, str], None] = nothing,
    ) -> SequenceRun:
        """Follow the organ through one splat (.ply) per time step, in the background; returns at once.

        splats: a folder, a pattern ("t_*.ply") or a .txt file with one path per line; fps: splats per second (None: the
        index is the frame's number). The nodes given to onDone play the surface and the transform CT to scene; the
        run's ``file`` is the .organphys-seq, for ``organphys map --frame``. InputError where Slicer has no sequences.
        """
        inputs = parameters if isinstance(parameters, RunInputs) else inputs_from_parameters(parameters)
        reasons = self.problems(inputs)
        if reasons:
            raise InputError(reasons[0])
        ensure_packages()
        return self._runs.start_sequence(inputs, str(splats), fps, SequenceCallbacks(onProgress, onDone, onFailed))

    def warmUp(self) -> None:
        """Start the registration process ahead of the first run, which is then about two seconds shorter."""
        self._runs.warm_up()

    def waitForRun(self, run: RegistrationRun, *, timeoutSeconds: float = 300.0) -> None:
        """Let Slicer's window live until the run is finished; TimeoutError when it takes longer."""
        end = time.monotonic() + timeoutSeconds
        while not run.finished:
            if time.monotonic() > end:
                raise TimeoutError(f"the registration is not finished after {timeoutSeconds:g} s")
            slicer.app.processEvents()
            time.sleep(0.005)

    def undo(self) -> CaseNodes | None:
        """Take back what the last run wrote; the case as it was before it, None if the run had made the case."""
        return self._runs.undo()

    def canUndo(self) -> bool:
        """Whether there is a run to undo."""
        return self._runs.can_undo

    # results

    def applyTransform(self, case: CaseNodes, node: Any, *, keepParent: bool = False) -> None:
        """Put a node that lies in the CT (tumour, vessels, a volume) under the case's CT-to-scene transform.

        keepParent: it stands under another transform already, which is then applied first.
        """
        apply_to(case, node, keep_parent=keepParent)

    def applyTransformToSegment(self, case: CaseNodes, segmentationNode: Any, segmentID: str) -> Any:
        """Copy one segment (a tumour of the CT's segmentation) into a segmentation node of its own, which stands under
        the case's CT-to-scene transform; that node. The source is not changed."""
        node = copy_segment(segmentationNode, segmentID)
        try:
            apply_to(case, node, keep_parent=True)
        except InputError:
            slicer.mrmlScene.RemoveNode(node)
            raise
        return node

    def export(self, case: CaseNodes, what: str, path: str | Path) -> str:
        """Write a file and return its path: "surface" (.stl, .ply, .vtp; RAS mm), "asset" (.organphys), "transform"
        (.h5, .nrrd) or "report" (report.html, or a folder for it). Without an ending the first one named is taken."""
        return export_case(case, what, path)

    def cleanup(self) -> None:
        """Give up a run and end the registration process; called when the application or the panel closes."""
        self._runs.close()

    def _check(self, inputs: RunInputs, stages: Sequence[str]) -> None:
        """InputError with the first thing that is in the way; missing packages are offered for installation."""
        if tuple(stages) not in STAGE_RUNS:
            raise InputError(f"stages: expected neighbours of {', '.join(STAGES)} in this order, got {list(stages)}")
        reasons = self.problems(inputs)
        if reasons:
            raise InputError(reasons[0])
        ensure_packages(weights=inputs.weights if inputs.method == "paper" else "rkpm")
