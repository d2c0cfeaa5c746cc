"""The host itself, where a fault in it would let a fault of the module pass."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
import qt
import slicer
import vtk


class Counter(threading.Thread):
    """A Python thread that counts as fast as it is let."""

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self.count, self.ended = 0, False

    def run(self) -> None:
        while not self.ended:
            self.count += 1

    def during(self, action) -> int:
        before = self.count
        action()
        return self.count - before


@pytest.fixture
def counter():
    thread = Counter()
    thread.start()
    yield thread
    thread.ended = True
    thread.join()


def test_python_threads_starve_in_the_event_loop_as_in_slicer(host, counter):
    free = counter.during(lambda: time.sleep(0.3))
    starved = counter.during(lambda: host.wait(0.3))
    assert starved < 0.25 * free


def test_a_timer_that_sleeps_lends_the_interpreter_to_threads(host, counter):
    starved = counter.during(lambda: host.wait(0.3))
    timer = qt.QTimer()
    timer.setInterval(10)
    timer.connect("timeout()", lambda: time.sleep(0.005))
    timer.start()
    lent = counter.during(lambda: host.wait(0.3))
    timer.stop()
    assert lent > 2 * starved


def test_latency_meter_sees_a_blocked_loop(host):
    def block_the_loop():
        time.sleep(0.3)

    with host.latency_meter() as meter:
        qt.QTimer.singleShot(20, block_the_loop)
        host.wait(0.5)
    assert meter.longest >= 0.3
    assert meter.turns > 10


def test_latency_meter_forgives_what_other_processes_take(host):
    work = "import time\nend = time.time() + 6\nwhile time.time() < end: pass"
    others = [subprocess.Popen([sys.executable, "-c", work]) for _ in range(3 * (os.cpu_count() or 1))]

    def spend(seconds=0.02):
        end = time.thread_time() + seconds
        while time.thread_time() < end:
            pass

    timer = qt.QTimer()
    timer.connect("timeout()", spend)
    timer.start(5)
    with host.latency_meter() as meter:
        host.wait(1.5)
    timer.stop()
    for other in others:
        other.kill()
        other.wait()
    assert meter.longest < 0.1


def test_latency_meter_counts_the_turns_of_a_free_loop(host):
    with host.latency_meter() as meter:
        host.wait(0.2)
    assert meter.turns > 10


def test_exceptions_of_callbacks_are_recorded(host):
    def fail():
        raise ValueError("from a slot")

    qt.QTimer.singleShot(0, fail)
    host.wait(0.05)
    assert len(host.record.errors) == 1 and "from a slot" in host.record.errors[0]
    host.record.clear()


def test_process_answers_as_in_pythonqt(host):
    process, received, ended = qt.QProcess(), [], []
    process.connect("readyReadStandardOutput()", lambda: received.append(process.readAllStandardOutput().data()))
    process.connect("finished(int,QProcess::ExitStatus)", lambda code, status: ended.append((code, status)))
    process.start(sys.executable, ["-u", "-c", "for line in open(0): print(line.strip() * 2, flush=True)"])
    process.write(b"ab\n")
    host.wait_until(lambda: b"abab" in b"".join(received), 20)
    process.write(qt.QByteArray(b"cd\n"))
    host.wait_until(lambda: b"cdcd" in b"".join(received), 20)
    assert process.state() == qt.QProcess.Running
    process.closeWriteChannel()
    host.wait_until(lambda: ended, 20)
    assert ended == [(0, qt.QProcess.NormalExit)]


def test_new_attributes_on_qt_objects_are_refused(host):
    with pytest.raises(AttributeError, match="colour"):
        qt.QLabel().colour = "red"


class _PlyReader:
    """Claims .ply files that begin with 'ply' and a comment 'mine'."""

    def __init__(self, parent):
        self.parent = parent

    def description(self):
        return "My points"

    def fileType(self):
        return "MyPly"

    def extensions(self):
        return ["My points (*.ply)"]

    def canLoadFileConfidence(self, path):
        return 0.8 if b"comment mine" in Path(path).read_bytes() else 0.0

    def load(self, properties):
        node = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLModelNode", "mine")
        self.parent.loadedNodes = [node.GetID()]
        return True


def _write_ply(path: Path, comment: str) -> Path:
    header = f"ply\nformat ascii 1.0\ncomment {comment}\nelement vertex 1\n"
    path.write_text(header + "property float x\nproperty float y\nproperty float z\nend_header\n1 2 3\n")
    return path


def test_the_most_confident_reader_loads_a_file(host, scene, tmp_path):
    manager = slicer.app.coreIOManager()
    manager.add_scripted_reader(_PlyReader)
    try:
        mine, other = _write_ply(tmp_path / "a.ply", "mine"), _write_ply(tmp_path / "b.ply", "other")
        assert manager.confidences(str(other))["ModelFile"] == pytest.approx(0.54)
        assert slicer.util.loadNodeFromFile(mine).GetName() == "mine"
        assert slicer.util.loadNodeFromFile(other).GetPolyData().GetNumberOfPoints() == 1
    finally:
        manager._scripted.pop()


def test_scene_saved_as_mrb_comes_back(host, scene, tmp_path):
    sphere = vtk.vtkSphereSource()
    sphere.Update()
    model = scene.AddNewNodeByClass("vtkMRMLModelNode", "ball")
    model.SetAndObservePolyData(sphere.GetOutput())
    transform = scene.AddNewNodeByClass("vtkMRMLLinearTransformNode", "shift")
    transform.SetMatrixTransformToParent(slicer.util.vtkMatrixFromArray(np.diag([2.0, 2.0, 2.0, 1.0])))
    model.SetAndObserveTransformNodeID(transform.GetID())
    assert slicer.util.saveScene(str(tmp_path / "scene.mrb"))
    host.clear_scene()
    assert scene.GetNumberOfNodesByClass("vtkMRMLModelNode") == 0
    slicer.util.loadScene(str(tmp_path / "scene.mrb"))
    again = slicer.util.getNode("ball")
    assert again.GetPolyData().GetNumberOfPoints() == sphere.GetOutput().GetNumberOfPoints()
    assert again.GetParentTransformNode().GetName() == "shift"


def test_many_calls_that_return_none_leave_the_interpreter_alive(host):
    label = qt.QLabel()
    before = sys.getrefcount(None)
    for _ in range(1000):
        label.setText("")
    assert before > 1 << 20  # immortal from Python 3.12 on, by the host before
    assert sys.getrefcount(None) > 1 << 20
