"""No figure of README or method page that was not measured: their tables are those of RESULTS.md."""

from __future__ import annotations

import importlib.util
import re
from types import ModuleType

import pytest
from doc_pages import PAGES, ROOT

BENCHMARKS = ROOT / "Testing" / "benchmarks"
MADE = ("README.md", "method.md")


@pytest.fixture(scope="module")
def figures() -> ModuleType:
    spec = importlib.util.spec_from_file_location("readme_figures", BENCHMARKS / "readme_figures.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("name", MADE)
def test_tables_are_those_of_the_results(name: str, figures: ModuleType) -> None:
    assert figures.refreshed(PAGES[name]) == PAGES[name], "run python Testing/benchmarks/readme_figures.py"


def test_a_changed_figure_is_noticed(figures: ModuleType) -> None:
    row = next(line for line in PAGES["README.md"].splitlines() if line.startswith("| spleen"))
    wrong = PAGES["README.md"].replace(row, re.sub(r"\d\.\d\d", "0.01", row))
    assert figures.refreshed(wrong) == PAGES["README.md"] != wrong


def test_every_figure_of_the_main_table_stands_in_the_results() -> None:
    results = "".join((BENCHMARKS / name).read_text(encoding="utf-8") for name in ("RESULTS.md", "RESULTS_PAPER.md"))
    measured = set(re.findall(r"\d+\.\d+", results))
    rows = PAGES["README.md"].split("<!-- accuracy")[1].split("<!-- end")[0]
    told = re.findall(r"\d+\.\d+", rows)
    assert len(told) > 40
    assert set(told) <= measured
