"""The commands under test. Their computing is done once; after that they only open, write and move their files."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from asset_examples import bent_organ
from session_examples import tiny_problem

from organphys.asset.asset_file import save_asset
from organphys.exports import report, sample_files
from organphys.pipeline import commands_register, commands_simulate, recorded_splat
from organphys.pipeline.command_line import main
from organphys.pipeline.sample_case import write_sample_case

SMALL = ("--handles", "6", "--quadrature", "150", "--fps", "10")
NAMES = ("register", "simulate", "export", "frames")
FILES = ("export",)  # those whose --out is a file
FRAMES = 3


class Commands:
    """``folder`` gets the inputs. ``call`` runs a command in this process; a child of it inherits what is computed."""

    def __init__(self, folder: Path) -> None:
        self.folder, self._kept = folder, dict[str, Callable[[pytest.MonkeyPatch], None]]()
        self._case = write_sample_case(folder / "case", size="small")
        self._asset, self._splat = folder / "organ.organphys", folder / "splat.ply"
        organ = bent_organ()
        save_asset(organ, self._asset)
        centres = organ.scene_vertices[::4]
        count = len(centres)
        sample_files.write_splat(
            self._splat,
            centres,
            np.full((count, 3), 0.01),
            np.tile([1.0, 0, 0, 0], (count, 1)),
            np.full((count, 3), 0.5),
            np.full(count, 0.9),
        )

    def argv(self, name: str, out: Path) -> list[str]:
        """The command line."""
        asset, splat = str(self._asset), ("--splat", str(self._splat))
        recording = str(self.folder / "run" / "recording.npz")
        words = {
            "register": ("--labels", str(self._case.labels), "--organ", "5", "--splat", str(self._case.splat)),
            "simulate": (asset, *SMALL, *splat),
            "export": (asset, "--format", "vtp"),
            "frames": (asset, "--format", "splat", *splat, "--recording", recording, "--at", "all"),
        }[name]
        return ["export" if name == "frames" else name, *words, "--quiet", "--out", str(out)]

    def compute(self, name: str) -> None:
        """Run the command once and keep what it computed."""
        if name == "frames":
            self.compute("simulate")
        if name in self._kept:
            return
        with pytest.MonkeyPatch.context() as patch:
            keep = {"register": self._register, "simulate": self._simulate, "frames": self._frames}.get(name)
            ready = keep(patch) if keep else lambda patch: None
            out = self.folder / ("run.vtp" if name in FILES else "run" if name == "simulate" else f"run_{name}")
            if main(self.argv(name, out)) != 0:
                raise RuntimeError(f"{name} fails without a fault")
        self._kept[name] = ready

    def call(self, name: str, out: Path, *, real: bool = False) -> int:
        """The exit code; ``real``: computing included, with the small settings of the tests."""
        with ExitStack() as stack:
            if real:
                stack.enter_context(tiny_problem())
            else:
                self._kept[name](stack.enter_context(pytest.MonkeyPatch.context()))
            return main(self.argv(name, out))

    def _register(self, patch: pytest.MonkeyPatch) -> Callable[[pytest.MonkeyPatch], None]:
        kept: dict[str, Any] = {}
        register, html = commands_register.register_files, report.report_html

        def keep(name: str, work: Callable[..., Any]) -> Callable[..., Any]:
            return lambda *given: kept.setdefault(name, work(*given))

        def small(*given: Any) -> Any:
            with tiny_problem():
                return register(*given)

        patch.setattr(commands_register, "register_files", keep("registration", small))
        patch.setattr(report, "report_html", keep("html", html))

        def ready(patch: pytest.MonkeyPatch) -> None:
            patch.setattr(commands_register, "register_files", lambda *_: kept["registration"])
            patch.setattr(report, "report_html", lambda _: kept["html"])

        return ready

    def _simulate(self, patch: pytest.MonkeyPatch) -> Callable[[pytest.MonkeyPatch], None]:
        kept: dict[str, Any] = {}
        prepared, run_plan, view = (
            commands_simulate.prepared,
            commands_simulate.run_plan,
            commands_simulate.SimulationView,
        )

        def keep(name: str, work: Callable[..., Any]) -> Callable[..., Any]:
            return lambda *given, **named: kept.setdefault(name, work(*given, **named))

        patch.setattr(commands_simulate, "prepared", keep("prepared", prepared))
        patch.setattr(commands_simulate, "run_plan", keep("run", run_plan))
        patch.setattr(commands_simulate, "SimulationView", keep("view", view))

        def ready(patch: pytest.MonkeyPatch) -> None:
            seen = SimpleNamespace(rows=kept["view"].rows, video=kept["view"].video, video_fps=10.0)
            patch.setattr(commands_simulate, "prepared", lambda *_: kept["prepared"])
            patch.setattr(commands_simulate, "run_plan", lambda *_, **__: kept["run"])
            patch.setattr(commands_simulate, "SimulationView", lambda *_, **__: seen)

        return ready

    def _frames(self, patch: pytest.MonkeyPatch) -> Callable[[pytest.MonkeyPatch], None]:
        moments = recorded_splat.moments
        few: list[Any] = []

        def first(recording: Any) -> Any:
            if not few:
                few.extend(moment for moment, _ in zip(moments(recording), range(FRAMES), strict=False))
            return few

        patch.setattr(recorded_splat, "moments", first)
        return lambda patch: patch.setattr(recorded_splat, "moments", first)
