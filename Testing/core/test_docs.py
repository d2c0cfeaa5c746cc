"""The documentation tells the truth: its examples run, its commands parse, its links and pictures are there."""

from __future__ import annotations

import json
import os
import re
from pathlib import Path

import pytest
from doc_pages import DOCS, PAGES, ROOT, commands, names_in, python_blocks, table_after
from session_examples import small_problem

from organphys import InputError
from organphys.pipeline.command_line import _with_negative_values, build_parser
from organphys.pipeline.sample_case import write_sample_case
from organphys_bench.command_line import parser as bench_parser

REPOSITORY = "https://github.com/OrganPhys/OrganPhys/blob/main/"
LARGEST_PICTURE = 300_000  # bytes
# Blocks go on from those before them; pages go on from the files of the first.
EXAMPLES = {"scripting.md": 5, "simulation.md": 1, "method.md": 2}


def run_examples(name: str) -> dict:
    names: dict = {}
    for number, block in enumerate(python_blocks(PAGES[name])):
        exec(compile(block, f"{name}, example {number + 1}", "exec"), names)
    return names


@pytest.fixture(scope="module")
def worked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder in which scripting.md was worked through, on the small sample case."""
    folder, before = tmp_path_factory.mktemp("docs"), Path.cwd()
    write_sample_case(folder, seed=0, size="small")
    os.chdir(folder)
    try:
        with small_problem():
            names = run_examples("scripting.md")
    finally:
        os.chdir(before)
    assert len(names["moved"]) == 100
    assert names["frame"].status == "tracked"
    return folder


def test_examples_are_counted() -> None:
    """None is lost to a typing error in its fence."""
    for name in [name for name in PAGES if name != "README.md"]:
        assert len(python_blocks(PAGES[name])) == EXAMPLES.get(name, 0), name
    assert len(python_blocks(PAGES["scripting.md"], slicer=True)) == 2


def test_scripting_examples_run(worked: Path) -> None:
    assert {"organ.organphys", "report.html", "breath.organphys-seq", "probe.npz"} <= {p.name for p in worked.iterdir()}


@pytest.mark.parametrize("name", ["simulation.md", "method.md"])
def test_other_examples_run(worked: Path, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(worked)
    run_examples(name)


def test_keys_of_registration_json_are_listed(worked: Path) -> None:
    told = names_in(table_after(PAGES["formats.md"], "## registration.json"))
    said = {"value", "unit", "code", "message", "T_scene_ct"}  # in the other cells
    assert set(told) - said == set(json.loads((worked / "registration.json").read_text()))


def test_a_wrong_example_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(PAGES, "method.md", "```python\nfrom organphys import read_box\nread_box('none.json')\n```\n")
    with pytest.raises(InputError, match="no such file"):
        run_examples("method.md")


@pytest.mark.parametrize("name", PAGES)
def test_commands_parse(name: str) -> None:
    for arguments in commands(PAGES[name]):
        build_parser().parse_args(_with_negative_values(arguments))


def test_every_command_is_shown() -> None:
    shown = {arguments[0] for arguments in commands(PAGES["command_line.md"])}
    assert shown == set(build_parser()._subparsers._group_actions[0].choices)  # type: ignore[union-attr]


@pytest.mark.parametrize("name", PAGES)
def test_options_exist(name: str) -> None:
    known = {"--additional-module-paths", "--no-main-window", "--testing", "--python-script", "--help"}
    parsers = build_parser()._subparsers._group_actions[0].choices.values()  # type: ignore[union-attr]
    for parser in (bench_parser(), *parsers):
        known |= {option for action in parser._actions for option in action.option_strings}
    assert set(re.findall(r"(?<![\w-])--[a-z][a-z-]+", PAGES[name])) <= known


@pytest.mark.parametrize("name", PAGES)
def test_links_lead_somewhere(name: str) -> None:
    folder = ROOT if name == "README.md" else DOCS
    for link in re.findall(r"\]\(([^)\s]+)\)", PAGES[name]):
        if link.startswith(REPOSITORY):
            assert (ROOT / link.removeprefix(REPOSITORY)).is_file(), link
        elif not link.startswith(("http://", "https://")):
            target, _, anchor = link.partition("#")
            assert not target or (folder / target).exists(), link
            page = PAGES[Path(target).name if target else name] if anchor else ""
            headings = {_slug(title) for title in re.findall(r"^#+ (.+)$", page, flags=re.MULTILINE)}
            assert not anchor or anchor in headings, link


def test_pictures_are_small_and_all_shown() -> None:
    text = "".join(PAGES.values())
    for picture in (DOCS / "pictures").iterdir():
        assert picture.stat().st_size < LARGEST_PICTURE, picture.name
        assert f"pictures/{picture.name})" in text, f"{picture.name} is shown nowhere"


def _slug(title: str) -> str:
    """The anchor of a heading, as GitHub and MyST make it."""
    return re.sub(r"[^\w\- ]", "", title.strip().lower()).replace(" ", "-")
