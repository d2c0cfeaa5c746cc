"""The pages of the documentation and what stands in them."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "Resources" / "Docs"
PAGES = {path.name: path.read_text(encoding="utf-8") for path in (ROOT / "README.md", *sorted(DOCS.glob("*.md")))}


def fenced(page: str, language: str) -> list[str]:
    """The code blocks of a language in a page's text."""
    blocks = re.findall(r"^```([^\n]*)\n(.*?)^```$", page, flags=re.DOTALL | re.MULTILINE)
    return [text for name, text in blocks if name == language]


def python_blocks(page: str, *, slicer: bool = False) -> list[str]:
    """Python examples, those for Slicer's console or the others."""
    return [block for block in fenced(page, "python") if ("OrganPhys" in block) == slicer]


def commands(page: str) -> list[list[str]]:
    """Arguments of every ``organphys`` command shown."""
    lines = "\n".join([*fenced(page, ""), *fenced(page, "sh")]).splitlines()
    return [shlex.split(line)[1:] for line in lines if line.startswith("organphys ")]


def table_after(page: str, heading: str) -> list[list[str]]:
    """Rows, without the head, of the first table below a heading."""
    below = page[page.index(f"\n{heading}\n") :]
    block = re.search(r"(?:^\|.*\n)+", below, flags=re.MULTILINE)
    assert block is not None, heading
    return [[cell.strip() for cell in line.strip().strip("|").split("|")] for line in block[0].splitlines()[2:]]


def names_in(rows: list[list[str]]) -> list[str]:
    """What is in backticks in the first cells."""
    return [name for row in rows for name in re.findall(r"`([^`]+)`", row[0])]
