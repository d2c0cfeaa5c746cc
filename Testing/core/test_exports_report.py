"""report.html: complete, self-contained, escaped; pictures and plots say what the figures say."""

import dataclasses
import re
from html.parser import HTMLParser
from itertools import product
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from asset_examples import bent_organ

from organphys.exports.camera_view import View
from organphys.exports.coarse_pictures import box_edges
from organphys.exports.picture_svg import scale_bar
from organphys.exports.report import report_html, write_report
from organphys.exports.report_content import PictureStrip, ReportContent, ReportTable, StagePicture
from organphys.exports.report_page import words
from organphys.exports.report_pictures import ramp_colours
from organphys.ground.notices import Notice
from organphys.ground.solve_report import SolveReport, Stop

STEPS = [
    SimpleNamespace(alpha=alpha, trim30_splat_to_ct_mm=2 / (k + 1), volume_drift_percent=-0.1 * k)
    for k, alpha in enumerate([0.4] * 3 + [0.1] * 4)
]
COARSE = SimpleNamespace(
    front_ct=np.array([0.0, 1, 0]),
    viewer_scene=np.array([0.0, 0, -1]),
    hull_segment_ct=np.array([[-40.0, -40, 110], [80, -40, 110]]),
    hull_diameter_mm=123.4,
    box_extent_scene=1.21,
    box_corners_scene=np.array(list(product((-0.5, 0.7), (-0.4, 0.4), (1.0, 1.5)))),
    twists_deg=np.arange(0, 360, 60.0),
    twist_costs=np.array([5.0, 6, 9, 8, 7, 2]),
    twist_cost_name="trimmed mean, mm",
    chosen_twist_deg=300.0,
)


@pytest.fixture(scope="module")
def content() -> ReportContent:
    organ = bent_organ()
    seen = organ.scene_vertices[organ.scene_vertices[:, 2] < np.median(organ.scene_vertices[:, 2])]
    return ReportContent(
        title="Registration of <ellipsoid> & co",
        faces=organ.faces,
        vertices_ct=organ.vertices,
        stages=[
            StagePicture("Coarse", organ.T_scene_ct.apply(organ.vertices)),
            StagePicture("Elastic", organ.scene_vertices, np.linspace(0, 5, len(organ.vertices))),
        ],
        splat_centres=seen,
        splat_colours=np.full((len(seen), 3), 0.6),
        mm_per_unit=100.0,
        method="organphys",
        notices=[Notice("few_seen", "Only 9 % <seen> & no more.")],
        highlights=[("organ volume", "220 ml")],
        inputs=[("label map", "/data/<x>.nii.gz")],
        metrics={
            "coarse": {"mean_ct_to_splat": {"value": 12.3456, "unit": "mm"}},
            "elastic": {"mean_ct_to_splat": {"value": 1.5, "unit": "mm"}, "drift": {"value": None, "unit": "%"}},
        },
        seconds={"read": 1.0, "total": 2.345},
        stops={"rigid": "converged", "elastic": SolveReport(Stop.STALLED, iterations=9)},
        coarse=COARSE,
        steps=STEPS,
        splat_to_ct_mm=np.abs(np.random.default_rng(0).normal(size=500)),
        ct_visible_to_splat_mm=np.array([0.5, np.nan, 1.0]),
        provenance={"seed": 0, "sha256": "ab<c"},
        extra_tables=[ReportTable("Truth", ("points", "TRE mm"), [("all", 1.234)])],
        extra_strips=[PictureStrip("Strip", [("a <caption>", np.zeros((8, 9, 3), np.uint8))])],
    )


class Balanced(HTMLParser):
    """Collects tags and checks that they close in order."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.attributes: list[tuple[str, str | None]] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.attributes += attrs
        if tag != "meta":
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.attributes += attrs

    def handle_endtag(self, tag: str) -> None:
        assert self.open and self.open[-1] == tag, f"</{tag}> closes {self.open[-3:]}"
        self.open.pop()


@pytest.fixture(scope="module")
def html(content: ReportContent) -> str:
    return report_html(content)


def test_tags_are_balanced_and_nothing_is_loaded_from_elsewhere(html: str) -> None:
    parser = Balanced()
    parser.feed(html)
    assert not parser.open
    addresses = [v for k, v in parser.attributes if k in ("href", "src", "xlink:href") and v]
    assert addresses and all(a.startswith(("data:image/", "#")) for a in addresses)
    assert not [k for k, _ in parser.attributes if k.startswith("on")] and "<script" not in html
    assert "@import" not in html and "url(http" not in html


def test_foreign_text_is_escaped(html: str) -> None:
    for foreign in ("<ellipsoid>", "<seen>", "<x>", "<caption>", "ab<c"):
        assert foreign not in html and foreign.replace("<", "&lt;").replace(">", "&gt;") in html


def test_every_section_is_there_and_warnings_come_first(html: str) -> None:
    heads = [
        "Truth",
        "Strip",
        "Inputs",
        "Overlay",
        "Distances",
        "Elastic stage",
        "Coarse stage",
        "Figures",
        "Time",
        "Prov",
    ]
    places = [html.index(f"<h2>{head}") for head in heads]
    assert places == sorted(places) and html.index("Only 9 %") < places[0]
    assert "1 warning: read before use." in html and "12.3" in html and "2.35 s" in html
    assert f"{Stop.STALLED.value} (iterations 9)" in html
    assert html.count("from the camera") == 4  # splat, two stages, distances
    assert html.count("data:image/jpeg") == 4 * 3 + 4 + 1


def test_bars_chosen_green_and_worst_crimson_once_each(html: str) -> None:
    assert html.count("fill: #2e9b57") == 1 and html.count("fill: #c2183c") == 1
    assert "α = 0.4" in html and "α = 0.1" in html and "d = 123.4 mm" in html


def test_report_is_the_same_each_time_and_small(content: ReportContent, html: str, tmp_path: Path) -> None:
    write_report(tmp_path / "report.html", content)
    assert (tmp_path / "report.html").read_text(encoding="utf-8") == html
    assert len(html) < 3_000_000 and len(list(tmp_path.iterdir())) == 1
    names = re.findall(r' id="([^"]+)"', html)
    assert not [n for n in names if n.startswith(("figure", "axes"))]


def test_empty_parts_are_left_out(content: ReportContent) -> None:
    empty = ("stages", "steps", "inputs", "notices", "highlights", "extra_tables", "extra_strips")
    nothing = {"metrics": {}, "seconds": {}, "stops": {}, "provenance": {}, "coarse": None}
    no_distances = {"splat_to_ct_mm": None, "ct_visible_to_splat_mm": None}
    bare = dataclasses.replace(content, **dict.fromkeys(empty, ()), **nothing, **no_distances)
    html = report_html(bare)
    assert "<h2>" not in html and "No warnings." in html


def test_box_edges_in_any_order() -> None:
    corners = np.array(list(product((0, 1.0), (0, 1.0), (0, 3.0))))[np.random.default_rng(1).permutation(8)]
    edges = box_edges(corners)
    lengths = sorted(round(float(np.linalg.norm(corners[i] - corners[j])), 6) for i, j in edges)
    assert lengths == [1.0] * 8 + [3.0] * 4


def test_scale_bar_is_true() -> None:
    view = View(np.zeros(3), np.array([0, 0, 2.0]), np.array([0, 1.0, 0]), 400.0, 400, 300)
    bar = scale_bar(view, mm_per_unit=100.0)  # 2 pixels per mm
    length = float(re.search(r">([\d.]+) mm<", bar).group(1))
    x1, x2 = (float(re.search(rf'{k}="([\d.]+)"', bar).group(1)) for k in ("x1", "x2"))
    assert length == 50 and x2 - x1 == pytest.approx(2 * length)


def test_cells_and_colours() -> None:
    assert [words(v) for v in (None, float("nan"), 3, 12345.6, 0.012345, "x")] == [
        "–",
        "–",
        "3",
        "12,346",
        "0.0123",
        "x",
    ]
    blue, red, grey = ramp_colours(np.array([0.0, 50.0, np.nan]), 5.0)
    assert blue[2] > blue[0] and red[0] > red[2] and np.ptp(grey) < 0.1


def test_gaussians_that_are_not_finite_are_left_out(content: ReportContent) -> None:
    centres = content.splat_centres.copy()
    centres[0, 1] = np.nan
    assert len(dataclasses.replace(content, splat_centres=centres).splat_centres) == len(centres) - 1
