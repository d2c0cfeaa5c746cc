"""The README tells the truth: its example runs, its commands and options exist."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from organphys.pipeline.command_line import build_parser
from organphys.pipeline.sample_case import write_sample_case

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def fenced(language: str) -> list[str]:
    """The code blocks of a language, without those for Slicer: Testing/slicer/test_readme_slicer.py runs these."""
    blocks = re.findall(rf"```{language}\n(.*?)```", README, flags=re.DOTALL)
    return [block for block in blocks if "slicer" not in block.lower()]


def test_python_examples_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    blocks = fenced("python")
    assert len(blocks) == 2
    write_sample_case(tmp_path, seed=0, size="small")
    monkeypatch.chdir(tmp_path)
    names: dict = {}
    exec(compile(blocks[0], "README.md", "exec"), names)
    assert {"organ.organphys", "registration.json", "surface.vtp", "report.html"} <= {
        p.name for p in tmp_path.iterdir()
    }
    exec(compile(blocks[1], "README.md", "exec"), {})  # goes on from the files of the first
    assert {"probe.npz", "moved.ply"} <= {p.name for p in tmp_path.iterdir()}
    back = np.linalg.norm(names["ct"] - names["organ"].vertices, axis=1)
    assert np.nanmax(back) < 0.1
    assert np.isfinite(back).mean() > 0.99


def test_commands_of_the_readme_parse() -> None:
    commands = [line for line in "\n".join(fenced("")).splitlines() if line.startswith("organphys ")]
    assert len(commands) >= 3
    for command in commands:
        build_parser().parse_args(command.split()[1:])


def test_options_of_the_readme_exist() -> None:
    known = set()
    for parser in build_parser()._subparsers._group_actions[0].choices.values():  # type: ignore[union-attr]
        known |= {option for action in parser._actions for option in action.option_strings}
    mentioned = "\n".join(line for line in README.splitlines() if not line.startswith("Slicer "))
    assert set(re.findall(r"--[a-z][a-z-]+", mentioned)) <= known


def test_make_targets_of_the_readme_exist() -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    for target in set(re.findall(r"`?make ([a-z]+)", README)):
        assert re.search(rf"^{target}:", makefile, flags=re.MULTILINE), target


def test_links_of_the_readme_lead_somewhere() -> None:
    for link in re.findall(r"\]\(([^)]+)\)", README):
        assert link.startswith("http") or (ROOT / link).exists(), link
