"""Fixtures of more than one test file."""

from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A sample case registered by one method of the benchmark in a child process: case folder and output folder."""
    from bench_examples import KEY

    from organphys.pipeline.sample_case import write_sample_case
    from organphys_bench.runs.pool import run_group

    root = tmp_path_factory.mktemp("bench")
    write_sample_case(root / "cases" / "tiny", size="small")
    assert run_group([KEY], root / "cases" / "tiny", root / "out") == {KEY: "done"}
    return root / "cases", root / "out"
