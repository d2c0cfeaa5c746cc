"""How long the simulation module keeps Slicer's window waiting: while it prepares, and while it runs.

    QT_QPA_PLATFORM=offscreen python Testing/benchmarks/simulation_panel.py [--gaussians 60000] [--seconds 1.5]

On the test host: 20 handles, 2000 quadrature points, a splat whose Gaussians are drawn, a gripper that goes into the
organ, rendering by software. The longest block is the longest time between two turns of the event loop; time in which
other programs had the processors does not count in it, as far as the kernel tells. Processor seconds: of all threads.
Writes its part of RESULTS.md.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from pathlib import Path

from results_file import machine_lines, write_part

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / folder) for folder in ("Testing/slicer", "OrganPhysSimulation", "OrganPhysRegistration")]
import host as slicer_host  # noqa: E402

TIMEOUT = 600  # s


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--gaussians", type=int, default=60_000)
    parser.add_argument("--seconds", type=float, default=1.5)
    options = parser.parse_args()
    host = slicer_host.start()
    logic, inputs = loaded(options.gaussians)
    done: list = []
    own, wall = time.process_time(), time.perf_counter()
    with host.latency_meter() as preparing:
        logic.prepare(lambda: done.append(None), done.append, **inputs)
        host.wait_until(lambda: done, TIMEOUT)
    if done[0] is not None:
        raise done[0]
    own, wall = time.process_time() - own, time.perf_counter() - wall
    live = logic.session.live
    logic.session.show_splat(True)
    logic.setJoints(live.joints_at_contact(), jawDeg=30)
    running_own, running_wall = time.process_time(), time.perf_counter()
    with host.latency_meter() as running:
        logic.run()
        host.wait_until(lambda: live.time_s > options.seconds, TIMEOUT)
    running_own, running_wall = time.process_time() - running_own, time.perf_counter() - running_wall
    command = " ".join(["QT_QPA_PLATFORM=offscreen python Testing/benchmarks/simulation_panel.py", *sys.argv[1:]])
    lines = ["# The simulation module's window", "", *machine_lines(command), ""]
    lines += ["| | longest block, ms | processor s | wall s |", "|---" * 4 + "|"]
    lines += [f"| preparing | {1e3 * preparing.longest:.0f} | {own:.1f} | {wall:.1f} |"]
    lines += [
        f"| running for {live.time_s:.1f} simulated s | {1e3 * running.longest:.0f} | {running_own:.1f} | "
        f"{running_wall:.1f} |"
    ]
    write_part(Path(__file__).with_name("RESULTS.md"), "\n".join(lines))
    print("\n".join(lines), flush=True)
    os._exit(0)  # Qt's and VTK's teardown may crash


def loaded(gaussians: int) -> tuple:
    """The logic, and the inputs of a simulation of the example organ."""
    import slicer
    from simulation_example import write_example

    from OrganPhysRegistrationLib.inputs.splat_node import load_splat
    from OrganPhysSimulationLib.logic import OrganPhysSimulationLogic

    files = write_example(Path(tempfile.mkdtemp()), gaussians=gaussians)
    logic = OrganPhysSimulationLogic()
    pins = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLMarkupsFiducialNode", "pins")
    pins.AddControlPointWorld(0, 175, 0)
    organ, splat = logic.loadOrgan(files.asset), load_splat(files.splat, mm_per_unit=100)
    inputs = {"organ_node": organ, "splat": splat, "pins": pins, "box": None, "pin_radius_mm": 20.0, "tissue": ""}
    more = {"youngs_kpa": 0.0, "gravity": None, "instrument": "large_needle_driver", "detail": False}
    return logic, inputs | more


if __name__ == "__main__":
    main()
