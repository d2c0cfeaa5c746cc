"""The settings whose worth the ablation measures."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

from organphys.align.splat_view import SplatView
from organphys.elastic.data_terms import DataOptions
from organphys.elastic.elastic_registration import ElasticOptions
from organphys.elastic.reduced_organ import ReducedOrganOptions


@dataclass(frozen=True)
class Settings:
    """One row of the table: options of the elastic stage and of its basis, and what is done to the view first."""

    elastic: ElasticOptions = field(default_factory=ElasticOptions)
    basis: ReducedOrganOptions | None = None
    view: Callable[[SplatView], SplatView] = lambda view: view


def data(**changes: float) -> Settings:
    """The default with other options of the data terms."""
    return Settings(ElasticOptions(data=DataOptions(**changes)))


def last_level(**changes: float) -> Settings:
    """The default with another last level of stiffness or robust width."""
    levels = ElasticOptions().levels
    return Settings(ElasticOptions(levels=(*levels[:-1], replace(levels[-1], **changes))))


def energy_alone() -> Settings:
    """Least elastic energy decides what is not seen, as in the paper, instead of the prior on loads."""
    return Settings(ElasticOptions(levels=tuple(replace(level, loads=0.0) for level in ElasticOptions().levels)))


def basis(**changes: float) -> Settings:
    """The default with another basis or material."""
    return Settings(basis=ReducedOrganOptions(**changes))


def rim_moved(pixels: float) -> Settings:
    """The default with the rim moved outwards by so many pixels more."""

    def move(view: SplatView) -> SplatView:
        rim = view.rim
        return replace(view, rim=replace(rim, points=rim.points + pixels * view.image.pixel * rim.normals))

    return Settings(view=move)


SETS = {
    "default": Settings(),
    "no rim": data(rim_weight=0.0),
    "rim weight 0.5": data(rim_weight=0.5),
    "rim 0.2 px outwards": rim_moved(0.2),
    "rim 0.2 px inwards": rim_moved(-0.2),
    "no organ to splat": data(organ_weight=0.0),
    "point to plane only": data(plane=1.0),
    "normals unused in matching": data(normal_weight=0.0),
    "noise alike in all directions": data(lateral_noise=1.0),
    "elastic energy alone": energy_alone(),
    "last alpha 0.03": last_level(alpha=0.03),
    "last alpha 0.003": last_level(alpha=0.003),
    "last tau 0.09": last_level(tau=0.09),
    "last tau 0.15": last_level(tau=0.15),
    "tissue held by tools kept": data(free_only=False),
    "data alike whatever is seen": Settings(ElasticOptions(seen_share=0.0)),
    "10 handles": basis(handles=10),
    "20 handles": basis(handles=20),
    "nu 0.35": basis(poissons_ratio=0.35),
}
