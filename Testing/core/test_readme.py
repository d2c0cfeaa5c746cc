"""The README tells the truth: its example runs on a full registration, its make targets exist; see test_docs.py too."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from doc_pages import PAGES, ROOT, python_blocks

from organphys.pipeline.sample_case import write_sample_case

README = PAGES["README.md"]


def test_python_example_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (block,) = python_blocks(README)
    write_sample_case(tmp_path, seed=0, size="small")
    monkeypatch.chdir(tmp_path)
    names: dict = {}
    exec(compile(block, "README.md", "exec"), names)
    assert {"organ.organphys", "registration.json", "surface.vtp", "report.html"} <= {
        p.name for p in tmp_path.iterdir()
    }
    back = np.linalg.norm(names["ct"] - names["organ"].vertices, axis=1)
    assert np.nanmax(back) < 0.1
    assert np.isfinite(back).mean() > 0.99


def test_make_targets_of_the_readme_exist() -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    for target in set(re.findall(r"`?make ([a-z]+)", README)):
        assert re.search(rf"^{target}:", makefile, flags=re.MULTILINE), target
