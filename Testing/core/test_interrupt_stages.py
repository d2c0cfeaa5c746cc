"""Ctrl-C at the beginning of every stage that a command tells: it stops, says so in one line, and leaves nothing."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType

import pytest

sys.path.append(str(Path(__file__).resolve().parents[1] / "faults"))

from commands import Commands

from organphys.ground.progress import Progress
from organphys.pipeline import commands_export, commands_register, commands_simulate

MODULES = {"register": commands_register, "simulate": commands_simulate, "frames": commands_export}
LEAST = {"register": {"read", "coarse", "rigid", "elastic"}, "simulate": {"read", "simulate", "write the results"}}


@pytest.fixture(scope="module")
def commands(tmp_path_factory: pytest.TempPathFactory) -> Commands:
    made = Commands(tmp_path_factory.mktemp("commands"))
    made.compute("frames")
    return made


@pytest.fixture
def watched(monkeypatch: pytest.MonkeyPatch) -> Callable[[ModuleType, Progress], None]:
    """Makes a command tell its progress to a function."""

    def watch(module: ModuleType, progress: Progress) -> None:
        @contextmanager
        def shown(*, quiet: bool) -> Iterator[Progress]:
            yield progress

        monkeypatch.setattr(module, "shown_progress", shown)

    return watch


@pytest.mark.parametrize("name", MODULES)
def test_ctrl_c_at_every_stage(
    commands: Commands,
    watched: Callable[[ModuleType, Progress], None],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    name: str,
) -> None:
    stages: dict[str, float] = {}
    watched(MODULES[name], stages.__setitem__)
    real = name != "frames"  # its frames are few otherwise
    assert commands.call(name, tmp_path / "whole", real=real) == 0
    assert stages and set(stages) >= LEAST.get(name, set()), stages
    handler = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        for wanted in stages:
            watched(
                MODULES[name], lambda stage, _, wanted=wanted: stage == wanted and signal.raise_signal(signal.SIGINT)
            )
            capsys.readouterr()
            assert commands.call(name, tmp_path / "out", real=real) == 130, wanted
            assert capsys.readouterr().err == "organphys: stopped, nothing was written\n", wanted
            assert [path.name for path in tmp_path.iterdir()] == ["whole"], wanted
    finally:
        signal.signal(signal.SIGINT, handler)
