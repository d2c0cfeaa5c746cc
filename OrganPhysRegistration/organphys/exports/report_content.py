"""What a report shows, as plain records that the pipeline fills in."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import Array
from ..ground.notices import Notice
from ..points.point_sets import Camera


class CoarseFigures(Protocol):
    """The coarse stage as drawn in the paper's Figures 4 to 6 (``align.records.CoarseView`` is one)."""

    @property
    def front_ct(self) -> Array: ...
    @property
    def viewer_scene(self) -> Array: ...
    @property
    def hull_segment_ct(self) -> Array: ...
    @property
    def hull_diameter_mm(self) -> float: ...
    @property
    def box_extent_scene(self) -> float: ...
    @property
    def box_corners_scene(self) -> Array: ...
    @property
    def twists_deg(self) -> Array: ...
    @property
    def twist_costs(self) -> Array: ...
    @property
    def twist_cost_name(self) -> str: ...
    @property
    def chosen_twist_deg(self) -> float: ...


class StepFigures(Protocol):
    """One outer step of the elastic stage (``elastic.records.ElasticStep`` is one)."""

    @property
    def alpha(self) -> float: ...
    @property
    def trim30_splat_to_ct_mm(self) -> float: ...
    @property
    def volume_drift_percent(self) -> float: ...


class ReasonText(Protocol):
    """One reason of a verdict."""

    @property
    def code(self) -> str: ...
    @property
    def message(self) -> str: ...


class VerdictText(Protocol):
    """Whether to trust the result (``pipeline.verdict.Verdict`` is one); level "trust", "check" or "do not trust"."""

    @property
    def level(self) -> str: ...
    @property
    def headline(self) -> str: ...
    @property
    def reasons(self) -> Sequence[ReasonText]: ...


@dataclass(frozen=True)
class StagePicture:
    """The organ surface after one stage: vertices (Nv, 3) in scene units; distances_mm (Nv,) to the splat, if known."""

    name: str
    vertices: Array
    distances_mm: Array | None = None


@dataclass(frozen=True)
class ReportTable:
    """A table of the report: cells are text, or numbers that are rounded to three digits."""

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[Any]]
    note: str = ""


@dataclass(frozen=True)
class PictureStrip:
    """Pictures side by side: captions and (h, w, 3) uint8 images."""

    title: str
    pictures: Sequence[tuple[str, NDArray[np.uint8]]]
    note: str = ""


@dataclass(frozen=True)
class ReportContent:
    """All that ``write_report`` needs. Empty fields leave their section out.

    highlights and inputs: label and text. faces (Nf, 3) and vertices_ct (Nv, 3) RAS mm: the organ surface; stages
    share its faces. metrics {stage: {name: {"value", "unit"}}}, seconds {stage: s}, stops {stage: reason}.
    splat_to_ct_mm, ct_visible_to_splat_mm (N,): final distances; errors_mm (Nv,): 95 % error radius of the vertices
    after the last stage. splat_centres (N, 3) scene units and splat_colours
    (N, 3) in 0..1: the splat as it is shown, best the whole target, up to some 100,000.
    """

    title: str
    faces: NDArray[np.int64]
    vertices_ct: Array
    stages: Sequence[StagePicture]
    splat_centres: Array
    splat_colours: Array
    mm_per_unit: float
    camera: Camera = field(default_factory=Camera)
    method: str = ""
    verdict: VerdictText | None = None
    notices: Sequence[Notice] = ()
    highlights: Sequence[tuple[str, str]] = ()
    inputs: Sequence[tuple[str, str]] = ()
    metrics: Mapping[str, Mapping[str, Mapping[str, Any]]] = field(default_factory=dict)
    seconds: Mapping[str, float] = field(default_factory=dict)
    stops: Mapping[str, Any] = field(default_factory=dict)
    coarse: CoarseFigures | None = None
    steps: Sequence[StepFigures] = ()
    splat_to_ct_mm: Array | None = None
    ct_visible_to_splat_mm: Array | None = None
    errors_mm: Array | None = None
    provenance: Mapping[str, Any] = field(default_factory=dict)
    extra_tables: Sequence[ReportTable] = ()
    extra_strips: Sequence[PictureStrip] = ()

    def __post_init__(self) -> None:
        centres, colours = np.asarray(self.splat_centres, dtype=np.float64), np.asarray(self.splat_colours, dtype=float)
        whole = np.isfinite(centres).all(1) & np.isfinite(colours).all(1)
        object.__setattr__(self, "splat_centres", centres[whole])
        object.__setattr__(self, "splat_colours", np.clip(colours[whole], 0, 1))
