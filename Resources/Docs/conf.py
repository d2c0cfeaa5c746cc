"""How Sphinx builds these pages: ``make docs``. Everything stays offline; formulas become MathML, without a script."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from docutils.nodes import SkipNode
from docutils.utils.math.latex2mathml import tex2mathml

ROOT = Path(__file__).resolve().parents[2]

project = "OrganPhys"
version = release = re.findall(r'^version = "(.+)"', (ROOT / "pyproject.toml").read_text(encoding="utf-8"), re.M)[0]
extensions = ["myst_parser"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
nitpicky = True
highlight_language = "sh"
html_theme = "alabaster"
html_theme_options = {"description": "A CT organ on its Gaussian splat", "page_width": "1220px", "fixed_sidebar": True}
html_math_renderer = "mathml"
html_static_path = ["pages.css"]
html_css_files = ["pages.css"]
html_show_copyright = False
html_copy_source = False


def inline_formula(translator: Any, node: Any) -> None:
    translator.body.append(tex2mathml(node.astext()))
    raise SkipNode


def displayed_formula(translator: Any, node: Any) -> None:
    translator.body.append(f'<div class="math">{tex2mathml(node.astext(), as_block=True)}</div>')
    raise SkipNode


def setup(app: Any) -> None:
    app.add_html_math_renderer(
        "mathml", inline_renderers=(inline_formula, None), block_renderers=(displayed_formula, None)
    )
