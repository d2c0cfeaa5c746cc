"""All methods by name; a method's own packages are imported when it runs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..problem.outcome import Clock, Outcome
    from ..problem.problem import Problem


@dataclass(frozen=True)
class Method:
    """title: for tables; place: "module:function" of this package; ``extra``: not one row of the main table;
    sweep_seeds: how many seeds of a sweep it runs at most, fewer where it takes long."""

    title: str
    place: str
    extra: bool = False
    sweep_seeds: int = 10

    @property
    def register(self) -> Callable[[Problem, Clock], Outcome]:
        module, function = self.place.split(":")
        return getattr(import_module(f"{__package__}.{module}"), function)


METHODS = {
    "rigid_icp": Method("rigid ICP", "rigid_icp:rigid_icp"),
    "similarity_icp": Method("similarity ICP", "rigid_icp:similarity_icp"),
    "coherent_drift": Method("coherent point drift", "coherent_drift:coherent_drift", sweep_seeds=3),
    "amberg": Method("Amberg non-rigid ICP", "amberg:amberg", sweep_seeds=3),
    "fem_icp_paper": Method("FEM elastic ICP, the paper's data term", "fem_icp:fem_icp_paper", sweep_seeds=1),
    "fem_icp": Method("FEM elastic ICP, OrganPhys's data terms", "fem_icp:fem_icp", sweep_seeds=1),
    "paper": Method("the paper's method", "paper:paper", sweep_seeds=1),
    "paper_same_start": Method("the paper's method, same start", "paper:paper_same_start", sweep_seeds=1),
    "paper_figure_8": Method("the paper's Figure 8", "paper:paper_figure_8", extra=True),
    "fem_icp_fine": Method("FEM elastic ICP, OrganPhys's data terms, fine mesh", "fem_icp:fem_icp_fine", extra=True),
    "organphys": Method("OrganPhys", "organphys_method:organphys"),
    "organphys_no_landmarks": Method("OrganPhys, no landmarks", "organphys_method:organphys_no_landmarks"),
}
OURS = ("organphys", "organphys_no_landmarks")
