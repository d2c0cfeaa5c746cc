"""organphys batch on worker processes: failures, deaths, interrupts; nothing is lost and nothing done twice."""

from __future__ import annotations

import argparse
import csv
import os
import signal
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from batch_examples import FILE, cheap_case, noted, tiny_register_case, write_table

from organphys.ground.checks import InputError
from organphys.pipeline import batch_cluster, commands_batch
from organphys.pipeline.batch_folder import RECORD
from organphys.pipeline.batch_run import run_cases
from organphys.pipeline.batch_table import read_batch
from organphys.pipeline.command_line import build_parser, main
from organphys.pipeline.sample_case import write_sample_case

pytest.importorskip("distributed", reason='needs Dask: pip install -c constraints.txt ".[batch]"')
HERE = Path(__file__).parent


def parsed(table: Path, out: Path, *more: str) -> argparse.Namespace:
    return build_parser().parse_args(["batch", str(table), "--out", str(out), "--quiet", *more])


def summary(out: Path) -> dict[str, dict[str, str]]:
    with (out / "summary.csv").open(encoding="utf-8", newline="") as file:
        return {row["case"]: row for row in csv.DictReader(file)}


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    """Two worker processes of one thread each."""
    with batch_cluster.local_client(2) as client:
        yield client


@pytest.fixture(scope="module")
def many(cluster: Any, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path, list[int]]:
    """200 cases of which some fail or kill their worker, and one of two workers killed midway; its process number."""
    folder = tmp_path_factory.mktemp("many")
    out, killed = folder / "out", list[int]()
    kinds = {7: 1, 50: 1, 51: 1, 120: 2, 199: 2, 90: 3, 60: 5}
    rows = [{"case": f"c{k:03d}", "organ": k, "seed": kinds.get(k, 0)} for k in range(200)]
    table = write_table(folder, rows)

    def kill_one() -> None:
        while "60" not in dict(noted(folder, "begin")):
            time.sleep(0.01)
        killed.append(dict(noted(folder, "begin"))["60"])
        os.kill(killed[0], signal.SIGKILL)

    killer = threading.Thread(target=kill_one, daemon=True)
    killer.start()
    code = commands_batch.run(parsed(table, out, "--scheduler", cluster.scheduler.address), work=cheap_case)
    killer.join(timeout=1)
    assert code == commands_batch.SOME_FAILED and killed
    return table, out, killed


def test_two_hundred_cases_with_failures_and_a_worker_killed_midway(many: tuple[Path, Path, list[int]]) -> None:
    out = many[1]
    rows = summary(out)
    assert list(rows) == [f"c{k:03d}" for k in range(200)]
    failed = {name: row["error"] for name, row in rows.items() if row["status"] == "failed"}
    assert set(failed) == {"c007", "c050", "c051", "c120", "c199", "c090"}
    assert failed["c050"] == "organ: nothing there; take another label"
    assert failed["c120"].startswith("error of the program, RuntimeError: a bug")
    assert failed["c090"].startswith("its worker process died twice")
    fine = Counter(row["status"] for name, row in rows.items() if name not in failed)
    assert sum(fine.values()) == 194 and fine["done"] >= 190  # of a dead worker's result only the folder may tell
    for name in rows:
        there = {path.name for path in (out / name).iterdir()} if (out / name).exists() else set()
        assert there == (set() if name in failed else {FILE, RECORD})
    assert not [path for path in (out / ".batch").iterdir() if path.suffix != ".lock"]


def test_nothing_is_done_twice(many: tuple[Path, Path, list[int]]) -> None:
    table = many[0]
    begun, ended = noted(table.parent, "begin"), Counter(organ for organ, _ in noted(table.parent, "end"))
    assert set(ended.values()) == {1} and len(ended) == 194
    assert {organ: count for organ, count in Counter(organ for organ, _ in begun).items() if count > 1} == {
        "60": 2,  # in the worker that was killed, and later alone
        "90": 2,  # took a worker along twice
    }


def test_the_same_command_goes_on_where_it_stopped(many: tuple[Path, Path, list[int]], cluster: Any) -> None:
    table, out, _ = many
    rows = table.read_text().replace(",1\n", ",0\n").splitlines()  # the bad ones are mended
    rows = [row for row in rows if row[-2:] not in (",2", ",3")]
    table.write_text("\n".join([*rows, "new,ct.nii.gz,300,splat.ply,0"]))
    before = len(noted(table.parent, "begin"))
    arguments = parsed(table, out, "--scheduler", cluster.scheduler.address)
    assert commands_batch.run(arguments, work=cheap_case) == 0
    done = [organ for organ, _ in noted(table.parent, "begin")[before:]]
    assert sorted(done) == ["300", "50", "51", "7"]
    told = summary(out)
    assert Counter(row["status"] for row in told.values()) == {"finished before": 194, "done": 4}
    assert told["c000"]["error [mm]"] == "1.5" and float(told["c000"]["seconds [s]"]) > 0
    page = (out / "summary.html").read_text(encoding="utf-8")
    assert "198 of 198 cases finished (194 before)" in page and 'href="c000/report.html"' in page


def test_two_batches_over_one_folder_share_the_work(cluster: Any, tmp_path: Path) -> None:
    table = write_table(tmp_path, [{"case": f"c{k}", "organ": k} for k in range(12)])
    codes: list[int] = []
    arguments = parsed(table, tmp_path / "out", "--scheduler", cluster.scheduler.address)
    both = [
        threading.Thread(target=lambda: codes.append(commands_batch.run(arguments, work=cheap_case))) for _ in range(2)
    ]
    for batch in both:
        batch.start()
    for batch in both:
        batch.join(timeout=60)
    assert codes == [0, 0]
    assert Counter(organ for organ, _ in noted(tmp_path, "begin")) == {str(k): 1 for k in range(12)}
    assert len(summary(tmp_path / "out")) == 12


def test_real_registrations(cluster: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from organphys.asset.asset_file import load_asset

    case = write_sample_case(tmp_path, seed=0, size="small")
    usual = {"labels": case.labels.name, "splat": case.splat.name, "mm_per_unit": round(case.mm_per_unit, 3)}
    rows = [{"case": "good", "organ": 5}, {"case": "no such label", "organ": 77}]
    table = write_table(tmp_path, [{**usual, **row} for row in rows], "real.csv")
    arguments = parsed(table, tmp_path / "out", "--scheduler", cluster.scheduler.address)
    arguments.quiet = False
    assert commands_batch.run(arguments, work=tiny_register_case) == commands_batch.SOME_FAILED
    told, rows_told = capsys.readouterr(), summary(tmp_path / "out")
    assert "failed: no such label (line 3): " in told.out and "1 of 2 cases finished, 1 failed" in told.out
    assert "2 of 2 cases, 1 failed" in told.err
    files = {path.name for path in (tmp_path / "out" / "good").iterdir()}
    assert files == {"organ.organphys", "registration.json", "surface.vtp", "report.html", RECORD}
    asset = tmp_path / "out" / "good" / "organ.organphys"
    assert load_asset(asset).mm_per_unit == pytest.approx(case.mm_per_unit, 1e-4)
    good = rows_told["good"]
    assert good["verdict"] in ("trust", "check") and 0 < float(good["splat to organ, nearest 70 % [mm]"]) < 5
    assert "77" in rows_told["no such label"]["error"]
    same_here = tmp_path / "same"  # the same seed gives the same asset, byte for byte, in any process of a machine
    same_here.mkdir()
    tiny_register_case(read_batch(table)[0].arguments, same_here)
    assert (same_here / asset.name).read_bytes() == asset.read_bytes()


INTERRUPTED = """
import sys
from batch_examples import cheap_case
from organphys.pipeline import commands_batch
from organphys.pipeline.command_line import main

if __name__ == "__main__":
    commands_batch.run.__kwdefaults__["work"] = cheap_case
    sys.exit(main(sys.argv[1:]))
"""


@pytest.mark.skipif(os.name == "nt", reason="signals are sent the POSIX way")
def test_ctrl_c_keeps_what_is_done(tmp_path: Path) -> None:
    rows = [{"case": f"c{k}", "organ": k, "seed": 4 if k > 5 else 0} for k in range(9)]
    table, out, program = write_table(tmp_path, rows), tmp_path / "out", tmp_path / "program.py"
    program.write_text(INTERRUPTED)
    command = [sys.executable, str(program), "batch", str(table), "--out", str(out), "--workers", "1"]
    with subprocess.Popen(
        command, stderr=subprocess.PIPE, text=True, start_new_session=True, env={**os.environ, "PYTHONPATH": str(HERE)},
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    ) as process:  # fmt: skip
        deadline = time.monotonic() + 120
        while len(noted(tmp_path, "begin")) < 7 and time.monotonic() < deadline:
            time.sleep(0.05)
        os.killpg(process.pid, signal.SIGINT)  # as a terminal does: to the workers too
        told = process.communicate(timeout=60)[1]
    assert process.returncode == 130, told
    assert told.splitlines()[-1] == (
        "organphys: stopped; 6 of 9 cases finished, 3 not run; run the same command again to go on"
    )
    assert "Traceback" not in told
    assert {path.name for path in out.iterdir()} == {f"c{k}" for k in range(6)} | {
        ".batch", "summary.csv", "summary.html",
    }  # fmt: skip
    assert not list((out / ".batch").glob("*.part"))
    assert [row["status"] for row in summary(out).values()] == ["done"] * 6 + ["not run"] * 3


@pytest.mark.parametrize(("threads", "asked"), [(2, []), (1, [2]), (0, [2])])
def test_workers_that_are_gone_for_good_are_started_anew(threads: int, asked: list[int]) -> None:
    """Dask gives a dead worker up that is not back in time: see batch_faults.py among the benchmarks."""
    found: list[int] = []
    ours = SimpleNamespace(cluster=SimpleNamespace(worker_spec={0: {}, 1: {}}, scale=found.append))
    batch_cluster.refill(ours, threads)
    assert found == asked
    batch_cluster.refill(SimpleNamespace(cluster=None), threads)  # someone else's cluster


def test_clusters_that_cannot_be_used(
    cluster: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    table = write_table(tmp_path, [{"case": "a"}])
    monkeypatch.setattr(batch_cluster, "_ANSWER_S", 0.5)
    assert main(["batch", str(table), "--out", str(tmp_path / "out"), "--scheduler", "tcp://127.0.0.1:9"]) == 2
    assert "no Dask scheduler answers" in capsys.readouterr().err.splitlines()[-1]
    assert main(["batch", str(table), "--out", str(tmp_path / "out"), "--scheduler", "nonsense://x"]) == 2
    assert not (tmp_path / "out").exists()
    monkeypatch.setattr(batch_cluster, "__version__", "9.9")
    with pytest.raises(InputError, match=r"worker tcp.* has organphys .*; install organphys 9\.9 there"):
        commands_batch.run(parsed(table, tmp_path / "out", "--scheduler", cluster.scheduler.address))


def test_a_scheduler_without_workers_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from distributed import LocalCluster

    monkeypatch.setattr(batch_cluster, "_WORKERS_S", 0.2)
    table = write_table(tmp_path, [{"case": "a"}])
    with (
        LocalCluster(n_workers=0, dashboard_address="127.0.0.1:0", host="127.0.0.1") as empty,
        pytest.raises(InputError, match="has no workers; start some with: dask worker tcp"),
    ):
        commands_batch.run(parsed(table, tmp_path / "out", "--scheduler", empty.scheduler_address))
    assert not (tmp_path / "out").exists()


def test_a_lost_scheduler_is_told_and_ends_the_run(tmp_path: Path) -> None:
    class Gone:
        def nthreads(self) -> dict[str, int]:
            raise OSError("Timed out trying to connect to the scheduler")

    outcomes: dict[str, Any] = {}
    cases = read_batch(write_table(tmp_path, [{"case": "a"}]))
    with pytest.raises(InputError, match="lost the Dask scheduler; what is finished is kept"):
        run_cases(cases, tmp_path / "out", Gone(), outcomes, work=cheap_case)
    assert outcomes == {}


def test_a_folder_that_cannot_be_written_is_told_first(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table = write_table(tmp_path, [{"case": "a"}])
    (tmp_path / "file").write_text("in the way")
    assert main(["batch", str(table), "--out", str(tmp_path / "file" / "out")]) == 2
    assert "cannot be written" in capsys.readouterr().err
    assert main(["batch", str(table), "--out", " "]) == 2
    assert "output folder: no name given" in capsys.readouterr().err


def test_missing_dask_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(batch_cluster, "find_spec", lambda name: None)
    assert main(["batch", str(tmp_path / "cases.csv"), "--out", str(tmp_path / "out")]) == 2
    assert capsys.readouterr().err == f"organphys: error: {batch_cluster.MISSING}\n"


@pytest.mark.parametrize("count", ["0", "-1", "x", "1.5", "9999"])
def test_worker_counts_that_cannot_be(tmp_path: Path, capsys: pytest.CaptureFixture[str], count: str) -> None:
    with pytest.raises(SystemExit) as leave:
        main(["batch", str(tmp_path / "cases.csv"), "--out", str(tmp_path / "out"), f"--workers={count}"])
    assert leave.value.code == 2 and "--workers: expected a whole number" in capsys.readouterr().err
