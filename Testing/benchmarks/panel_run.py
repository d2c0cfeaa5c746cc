"""Seconds from pressing Register to the final overlay, and the longest block of the event loop, in the real panel.

python Testing/benchmarks/panel_run.py CASE_FOLDER ... [--runs N]    (slicer-core and PySide6: see Testing/slicer/host)
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
MODULE = ROOT / "OrganPhysRegistration" / "OrganPhysRegistration.py"
sys.path[:0] = [str(ROOT / "Testing" / "slicer"), str(MODULE.parent)]

import host as slicer_host  # noqa: E402

WARM_UP_SECONDS = 8.0


def measure(host: object, module: object, folder: Path, runs: int) -> None:
    import slicer

    from OrganPhysRegistrationLib.panel.register_section import RegisterSection

    host.clear_scene()
    label = json.loads((folder / "case.json").read_text())["label_id"]
    segmentation = slicer.util.loadSegmentation(str(folder / "ct_labels.nii.gz"))
    content = segmentation.GetSegmentation()
    segment = next(s for s in content.GetSegmentIDs() if content.GetSegment(s).GetLabelValue() == label)
    splat = module.logic.loadSplat(folder / "splat.ply")
    landmarks = slicer.util.loadMarkups(str(folder / "landmarks.mrk.json"))
    panel = module.widget.panel
    panel.choose({"segmentation": segmentation, "segmentID": segment, "splat": splat, "landmarks": landmarks})
    register = next(section for section in panel.sections if isinstance(section, RegisterSection))
    host.wait(WARM_UP_SECONDS)
    for run in range(runs):
        marks = {}
        with host.latency_meter() as meter:
            began = time.perf_counter()
            module.ui.applyButton.click()
            while register.running:
                host.wait(0.02)
                if register.run.state == "sampling":
                    marks.setdefault("overlay", time.perf_counter() - began)
            marks["transform"] = time.perf_counter() - began
        host.process()
        times = ", ".join(f"{name} after {seconds:.1f} s" for name, seconds in marks.items())
        print(f"{folder.name:16s} run {run + 1}: {times}, longest block {1000 * meter.longest:.0f} ms", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cases", type=Path, nargs="+")
    parser.add_argument("--runs", type=int, default=2)
    arguments = parser.parse_args()
    host = slicer_host.start()
    module = host.load(MODULE)
    for folder in arguments.cases:
        measure(host, module, folder, arguments.runs)
    host.close(module)
    host.remove_files()
    sys.stdout.flush()
    os._exit(0)  # the teardown of Qt and VTK may crash


if __name__ == "__main__":
    main()
