"""The registration server: every line is answered, nothing else comes to stdout, a cancel leaves it usable."""

import io
import json
import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from scene_examples import FRONT_CT, bend, bumpy_organ, seen_from_camera

import organphys
from organphys.ground.checks import InputError
from organphys.ground.progress import Cancelled
from organphys.pipeline.case_file import load_case
from organphys.pipeline.outcome_files import load_outcome, save_case
from organphys.pipeline.server_channel import Channel
from organphys.pipeline.server_requests import Requests
from organphys.pipeline.session_server import answer
from organphys.points.point_sets import Landmarks

VOXEL_MM = 5.0


class Client:
    """The other end of a channel in this process; ``run(request)`` does the work."""

    def __init__(self, run):
        source, self.requests = os.pipe()
        self.replies, sink = os.pipe()
        self.channel = Channel(os.fdopen(source, "rb"), os.fdopen(sink, "wb", buffering=0))
        self.reader, self.run = os.fdopen(self.replies, "rb"), run
        self.thread = threading.Thread(target=self._serve, daemon=True)
        self.thread.start()

    def _serve(self):
        while (request := self.channel.next()) is not None:
            answer(self.channel, self.run, request)

    def send(self, line):
        text = line if isinstance(line, bytes) else json.dumps(line).encode()
        os.write(self.requests, text + b"\n")

    def event(self):
        return json.loads(self.reader.readline())

    def close(self):
        os.close(self.requests)
        self.thread.join(10)
        assert not self.thread.is_alive()


@pytest.mark.parametrize(
    "line",
    [b"hello", b"[1, 2]", b'"x"', b"{", b"\xff\xfe", b"[" * 3000, b'{"id": 1}', b'{"id": 2, "do": "dance"}',
     b'{"do": ["coarse"]}', b'{"id": 3, "do": "coarse"}', b'{"do": "load"}', b'{"do": "load", "case": "../case.npz"}',
     b'{"do": "load", "case": "none.npz"}', b'{"do": "grids"}', b'{"do": "report", "folder": 3}'],
)  # fmt: skip
def test_what_cannot_be_done_is_answered_and_the_server_goes_on(tmp_path, line):
    client = Client(lambda request: Requests(client.channel, tmp_path).run(request))
    for _ in range(2):
        client.send(line)
        events = [client.event()]
        while events[-1]["event"] == "progress":
            events.append(client.event())
        assert events[-1]["event"] == "failed" and events[-1]["code"] == "input", events
        assert events[-1]["message"] and "\n" not in events[-1]["message"]
    client.close()


def test_every_way_to_end_is_one_reply(capfd):
    ends = {"done": None, "input": InputError("two\nlines"), "internal": ZeroDivisionError("x"), "stop": Cancelled()}

    def run(request):
        end = ends[request.fields["do"]]
        if end is not None:
            raise end
        return {"outcome": "outcome_1"}

    client = Client(run)
    for number, do in enumerate(ends):
        client.send({"id": number, "do": do})
    replies = [client.event() for _ in ends]
    client.close()
    assert [reply["id"] for reply in replies] == [0, 1, 2, 3]
    assert replies[0] == {"id": 0, "event": "done", "outcome": "outcome_1"}
    assert [reply.get("code") for reply in replies[1:]] == ["input", "internal", "cancelled"]
    assert replies[1]["message"] == "two lines" and "ZeroDivisionError" in replies[2]["message"]
    assert "Traceback" in capfd.readouterr().err


def wait_for_cancel(channel, request):
    end = time.monotonic() + 10
    while time.monotonic() < end:
        if channel.is_cancelled(request):
            raise Cancelled
    raise TimeoutError


def test_cancel_ends_what_runs_and_waits_and_nothing_later():
    running = threading.Event()

    def run(request):
        if request.fields["do"] == "quick":
            return {}
        running.set()
        wait_for_cancel(client.channel, request)

    client = Client(run)
    client.send({"do": "cancel"})  # nothing runs
    client.send({"id": 1, "do": "quick"})
    assert client.event() == {"id": 1, "event": "done"}
    client.send({"id": 2, "do": "long"})
    client.send({"id": 3, "do": "long"})
    assert running.wait(10)
    client.send({"do": "cancel"})
    client.send({"id": 4, "do": "quick"})
    replies = [client.event() for _ in range(3)]
    assert [(reply["id"], reply.get("code")) for reply in replies] == [(2, "cancelled"), (3, "cancelled"), (4, None)]
    client.close()


def test_end_of_the_client_ends_what_runs():
    running = threading.Event()

    def run(request):
        running.set()
        wait_for_cancel(client.channel, request)

    client = Client(run)
    client.send({"id": 1, "do": "long"})
    assert running.wait(10)
    client.close()


def test_numbers_that_json_lacks_are_sent_as_null():
    sink = io.BytesIO()
    Channel(io.BytesIO(), sink).tell(event="progress", fraction=float("nan"), matrix=np.eye(1))
    assert json.loads(sink.getvalue()) == {"event": "progress", "fraction": None, "matrix": [[1.0]]}


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    """A folder with the case of a bumpy organ."""
    organ, folder = bumpy_organ(voxel_mm=VOXEL_MM), tmp_path_factory.mktemp("server")
    low = organ.volume_points.min(0) - 2 * VOXEL_MM
    index = np.rint((organ.volume_points - low) / VOXEL_MM).astype(int)
    mask = np.zeros(index.max(0)[::-1] + 3, dtype=bool)
    mask[index[:, 2], index[:, 1], index[:, 0]] = True
    affine = np.diag([VOXEL_MM, VOXEL_MM, VOXEL_MM, 1.0])
    affine[:3, 3] = low
    landmark = Landmarks(organ.vertices[[(organ.vertices @ FRONT_CT).argmax()]])
    seen = seen_from_camera(organ, deformation=bend, count=4000)
    save_case(folder, mask=mask, ijk_to_ras=affine, name="liver", splat=seen.cloud, landmarks=landmark)
    return folder


def talk(folder, *requests):
    """All lines of a server process that is sent the requests one after the other, and its stderr."""
    server = start("-m", "organphys.pipeline.session_server", "--folder", str(folder))
    events = [json.loads(server.stdout.readline())]
    for request in requests:
        server.stdin.write(json.dumps(request).encode() + b"\n")
        server.stdin.flush()
        while True:
            events.append(json.loads(server.stdout.readline()))
            if events[-1]["event"] in ("done", "failed"):
                break
    rest, errors = server.communicate(timeout=60)
    assert rest == b"" and server.returncode == 0
    return events, errors.decode()


def start(*arguments):
    environment = {**os.environ, "PYTHONPATH": str(Path(organphys.__file__).parents[1])}
    pipes = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.PIPE)
    return subprocess.Popen([sys.executable, *arguments], env=environment, **pipes)


def test_what_libraries_print_goes_to_stderr():
    code = (
        "import os; from organphys.pipeline.server_channel import Channel; channel = Channel.of_this_process();"
        "print('python', flush=True); os.write(1, b'library'); channel.tell(event='ready')"
    )
    output, errors = start("-c", code).communicate(timeout=60)
    assert json.loads(output) == {"event": "ready"} and b"python" in errors and b"library" in errors


def test_a_whole_run_in_a_process_of_its_own(case):
    pose = np.eye(4).tolist()
    events, errors = talk(
        case,
        {"id": 1, "do": "load", "case": "case.npz"},
        {"id": 2, "do": "grids"},
        {"id": 3, "do": "coarse"},
        {"id": 4, "do": "rigid", "start": [[1, 2], [3, 4]]},
        {"id": 5, "do": "elastic", "start": None},
        {"id": 6, "do": "grids"},
        {"id": 7, "do": "report", "folder": str(case / "report")},
        {"id": 8, "do": "rigid", "start": pose},
        {"id": 9, "do": "report", "folder": "report"},
    )
    assert events[0]["event"] == "ready" and events[0]["organphys"] == organphys.__version__
    assert Path(events[0]["file"]) == Path(organphys.__file__) and events[0]["pid"] > 0
    ends = {event["id"]: event for event in events if event["event"] in ("done", "failed")}
    assert ends[1]["event"] == "done"
    assert (
        "run it first" in ends[2]["message"] and "4, 4" in ends[4]["message"] and "run it first" in ends[9]["message"]
    )
    coarse, elastic, grids, rigid = (load_outcome(case / ends[number]["outcome"]) for number in (3, 5, 6, 8))
    assert (coarse.stage, elastic.stage, grids.stage, rigid.stage) == ("coarse", "elastic", "elastic", "rigid")
    assert elastic.grids is None and grids.grids.forward.error_mm["max"] < 0.1
    np.testing.assert_array_equal(elastic.surfaces["elastic"], grids.surfaces["elastic"])
    progress = [event for event in events if event["event"] == "progress"]
    assert {"coarse", "rigid", "elastic", "grids"} <= {event["stage"] for event in progress}
    assert all(0 <= event["fraction"] <= 1 for event in progress)
    surfaces = [event for event in events if event["event"] == "surface"]
    assert surfaces and {event["stage"] for event in surfaces} == {"elastic"}
    assert np.load(case / surfaces[-1]["file"]).shape == elastic.vertices_ct.shape
    assert not list(case.glob(".surface*")) and errors == ""
    assert ends[7] == {"id": 7, "event": "done", "folder": str(case / "report")}
    names = {path.name for path in (case / "report").iterdir()}
    assert names == {"organ.organphys", "registration.json", "surface.vtp", "report.html"}
    here = load_case(case / "case.npz").coarse()
    np.testing.assert_array_equal(coarse.similarities["coarse"], here.similarities["coarse"])
    assert coarse.notices == here.notices and coarse.metrics == here.metrics


def test_updates_of_a_registered_case(case):
    moved = load_case(case / "case.npz").state.case.landmarks + 3.0
    events, errors = talk(
        case,
        {"id": 1, "do": "update", "stiffness": 0.02},
        {"id": 2, "do": "load", "case": "case.npz"},
        {"id": 3, "do": "elastic"},
        {"id": 4, "do": "update", "stiffness": 0.03},
        {"id": 5, "do": "update", "landmarks": moved.tolist(), "names": ["a"]},
        {"id": 6, "do": "update", "landmarks": [[1, 2]]},
        {"id": 7, "do": "update", "stiffness": True},
        {"id": 8, "do": "update"},
        {"id": 9, "do": "settle"},
    )
    ends = {event["id"]: event for event in events if event["event"] in ("done", "failed")}
    assert {number for number, end in ends.items() if end["event"] == "failed"} == {1, 6, 7, 8} and errors == ""
    assert all(ends[number]["code"] == "input" for number in (1, 6, 7, 8))
    first, stiffer, settled = (load_outcome(case / ends[number]["outcome"]) for number in (3, 4, 9))
    assert tuple(stiffer.surfaces) == ("elastic",) and stiffer.asset is None  # what moves, no more
    assert np.abs(stiffer.surfaces["elastic"] - first.surfaces["elastic"]).max() > 0
    assert settled.asset and tuple(settled.surfaces) == ("before", "coarse", "rigid", "elastic")
