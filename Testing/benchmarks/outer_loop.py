"""Registering again after a moved landmark or another stiffness: seconds, and how far from a full run.

python Testing/benchmarks/outer_loop.py CASE_FOLDER [--updates N] [--panel] [--no-write]

--panel: also in the real panel (slicer-core and PySide6): from the change to the moved surface, and the longest block
of the event loop.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from case_inputs import CaseInputs, read_case
from measured import how
from results_file import write_part

from organphys.pipeline.registration import RegisterOptions
from organphys.pipeline.session import RegistrationSession
from organphys.points.point_sets import Landmarks

RESULTS = Path(__file__).with_name("RESULTS.md")
ROOT = Path(__file__).resolve().parents[2]
ALPHAS = (0.02, 0.01, 0.006, 0.03, 0.05, 0.012, 0.1, 0.008)
MOVED_MM = 6.0  # standard deviation of a moved landmark along each axis
COMPARED = 1  # update of each kind that is compared with a full run


class Measured:
    """Seconds and processor seconds of calls."""

    def __init__(self) -> None:
        self.wall: list[float] = []
        self.cpu: list[float] = []

    def call(self, work: Callable[[], Any]) -> Any:
        begin = time.perf_counter(), time.process_time()
        found = work()
        self.wall.append(time.perf_counter() - begin[0])
        self.cpu.append(time.process_time() - begin[1])
        return found

    def cells(self) -> str:
        numbers = (np.median(self.wall), np.percentile(self.wall, 95), np.median(self.cpu), np.percentile(self.cpu, 95))
        return " | ".join(f"{number:.2f}" for number in numbers)


def core_rows(inputs: CaseInputs, updates: int) -> list[str]:
    """The session alone."""
    session, full, prepare = _session(inputs, inputs.landmarks), Measured(), Measured()
    full.call(session.elastic)
    prepare.call(session.prepare_updates)
    rng, rows = np.random.default_rng(0), []
    stiffness, errors = Measured(), []
    for k in range(updates):
        alpha = ALPHAS[k % len(ALPHAS)] * float(np.exp(0.05 * rng.normal()))
        outcome = stiffness.call(lambda alpha=alpha: session.updated(stiffness=alpha))
        if k < COMPARED:
            errors.append(_apart_mm(outcome, _session(inputs, inputs.landmarks, stiffness=alpha).elastic()))
    rows.append(f"| stiffness slider | {updates} | {stiffness.cells()} | {max(errors):.2g} |")
    session.updated(stiffness="moderate")
    landmarks, errors = Measured(), []
    for k in range(updates):
        moved = Landmarks(inputs.landmarks.positions + rng.normal(0, MOVED_MM, inputs.landmarks.positions.shape))
        outcome = landmarks.call(lambda moved=moved: session.updated(landmarks=moved))
        if k < COMPARED:
            errors.append(_apart_mm(outcome, _session(inputs, moved).elastic()))
    rows.append(f"| moved landmark | {updates} | {landmarks.cells()} | {max(errors):.2g} |")
    rows.append(f"| (settled: whole outcome, search repeated) | 1 | {_once(session.settled).cells()} | 0 |")
    rows.append(f"| (getting ready for moved landmarks, once) | 1 | {prepare.cells()} | |")
    rows.append(f"| (full run from nothing, its outcome included) | 1 | {full.cells()} | |")
    return rows


def _session(inputs: CaseInputs, landmarks: Landmarks | None, **options: Any) -> RegistrationSession:
    return RegistrationSession(
        inputs.organ, inputs.splat, RegisterOptions(**options), landmarks=landmarks, camera=inputs.camera,
        box=inputs.box,
    )  # fmt: skip


def _apart_mm(one: Any, other: Any) -> float:
    """Farthest that a vertex lies from its place in another outcome, mm."""
    return float(np.linalg.norm(one.surfaces["elastic"] - other.surfaces["elastic"], axis=1).max() * other.mm_per_unit)


def _once(work: Callable[[], Any]) -> Measured:
    measured = Measured()
    measured.call(work)
    return measured


def panel_rows(folder: Path, updates: int) -> list[str]:
    """In the panel on the test host: a child process registers, the main thread moves the surface."""
    module_file = ROOT / "OrganPhysRegistration" / "OrganPhysRegistration.py"
    sys.path[:0] = [str(ROOT / "Testing" / "slicer"), str(module_file.parent)]
    import host as slicer_host

    host = slicer_host.start()
    module = host.load(module_file)
    try:
        return _live_rows(host, module, folder, updates)
    finally:  # a registration process left running would outlive its Qt object
        host.close(module)
        host.remove_files()


def _live_rows(host: Any, module: Any, folder: Path, updates: int) -> list[str]:
    """Rows of the table for a loaded module."""
    import slicer

    from OrganPhysRegistrationLib.panel.live_section import LiveSection
    from OrganPhysRegistrationLib.panel.register_section import RegisterSection

    label = json.loads((folder / "case.json").read_text())["label_id"]
    segmentation = slicer.util.loadSegmentation(str(folder / "ct_labels.nii.gz"))
    content = segmentation.GetSegmentation()
    segment = next(s for s in content.GetSegmentIDs() if content.GetSegment(s).GetLabelValue() == label)
    splat = module.logic.loadSplat(folder / "splat.ply")
    landmarks = slicer.util.loadMarkups(str(folder / "landmarks.mrk.json"))
    panel = module.widget.panel
    panel.choose({"segmentation": segmentation, "segmentID": segment, "splat": splat, "landmarks": landmarks})
    sections = {type(section): section for section in panel.sections}
    host.process()
    module.ui.applyButton.click()
    host.wait_until(lambda: not sections[RegisterSection].running, 300)
    host.wait_until(lambda: module.ui.liveCheckBox.enabled, 60)  # the panel is refreshed a moment after the run
    module.ui.liveCheckBox.click()
    live = sections[LiveSection].live
    if live is None:
        raise RuntimeError(module.ui.messageLabel.text)
    host.wait_until(lambda: live.state == "idle", 120)
    seconds: list[float] = []
    object.__setattr__(live._tell, "updated", lambda case, s: seconds.append(time.perf_counter()))
    rows, rng = [], np.random.default_rng(0)
    for kind in ("stiffness slider", "moved landmark"):
        taken, blocks = [], []
        for k in range(updates):
            count = len(seconds)
            with host.latency_meter() as meter:
                begin = time.perf_counter()
                if kind == "stiffness slider":
                    module.ui.stiffnessSlider.value = 20 + 7 * (k % 9) + k // 9
                else:
                    place = [0.0, 0.0, 0.0]
                    landmarks.GetNthControlPointPositionWorld(0, place)
                    landmarks.SetNthControlPointPositionWorld(0, *(np.array(place) + rng.normal(0, 3.0, 3)))
                host.wait_until(lambda count=count: len(seconds) > count, 60)
            taken.append(seconds[-1] - begin)
            blocks.append(meter.longest)
        with host.latency_meter() as meter:
            host.wait_until(lambda: not live._unsettled, 120)
        rows.append(
            f"| {kind} | {updates} | {np.median(taken):.2f} | {np.percentile(taken, 95):.2f} "
            f"| {1000 * np.median(blocks):.0f} | {1000 * max(blocks):.0f} | {1000 * meter.longest:.0f} |"
        )
    return rows


def markdown(core: Sequence[str], panel: Sequence[str], command: str, name: str) -> str:
    """This benchmark's part of RESULTS.md."""
    lines = [
        "# Registering again: the outer loop",
        "",
        f"Case {name}. From the change to the new surface with its figures. Processor seconds are of all threads "
        "together: an upper bound of the seconds on two quiet cores. Difference from a full run with the same inputs: "
        f"the farthest vertex of one update.",
        "",
        how(command),
        "",
        "| change | updates | s median | s p95 | processor s median | processor s p95 | difference, mm |",
        "| --- | --- | --- | --- | --- | --- | --- |",
        *core,
    ]
    if panel:
        lines += [
            "",
            "In the panel, from the change (50 ms waiting for the next one included) to the moved surface node:",
            "",
            "| change | updates | s median | s p95 | longest block, ms, median | worst | worst while settling |",
            "| --- | --- | --- | --- | --- | --- | --- |",
            *panel,
        ]
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("case", type=Path)
    parser.add_argument("--updates", type=int, default=20)
    parser.add_argument("--panel", action="store_true")
    parser.add_argument("--no-write", action="store_true")
    arguments = parser.parse_args()
    core = core_rows(read_case(arguments.case), arguments.updates)
    print("\n".join(core), flush=True)
    panel = panel_rows(arguments.case, arguments.updates) if arguments.panel else []
    print("\n".join(panel), flush=True)
    if not arguments.no_write:
        more = " --panel" if arguments.panel else ""
        command = f"python Testing/benchmarks/outer_loop.py {arguments.case.name} --updates {arguments.updates}{more}"
        write_part(RESULTS, markdown(core, panel, command, arguments.case.name))
    sys.stdout.flush()
    os._exit(0)  # the teardown of Qt and VTK may crash


if __name__ == "__main__":
    main()
