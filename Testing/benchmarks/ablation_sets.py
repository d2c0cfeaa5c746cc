"""The settings whose worth the ablation measures."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

from scipy.spatial import cKDTree

from organphys.align.splat_view import SplatView
from organphys.elastic.data_terms import DataOptions
from organphys.elastic.elastic_registration import ElasticLevel, ElasticOptions
from organphys.elastic.reduced_organ import ReducedOrganOptions


@dataclass(frozen=True)
class Settings:
    """One row of the table: options of the elastic stage and of its basis, what is done to the view first, and whether
    the scale stays that of the start."""

    elastic: ElasticOptions = field(default_factory=ElasticOptions)
    basis: ReducedOrganOptions | None = None
    view: Callable[[SplatView], SplatView] = lambda view: view
    scale_held: bool = False


def data(**changes: float) -> Settings:
    """The default with other options of the data terms."""
    return Settings(ElasticOptions(data=DataOptions(**changes)))


def last_level(**changes: float) -> Settings:
    """The default with another last level of stiffness or robust width."""
    levels = ElasticOptions().levels
    return Settings(ElasticOptions(levels=(*levels[:-1], replace(levels[-1], **changes))))


def robust_widths(*taus: float) -> Settings:
    """The default with other robust widths, level by level."""
    return Settings(ElasticOptions(levels=tuple(map(_with_tau, ElasticOptions().levels, taus))))


def _with_tau(level: ElasticLevel, tau: float) -> ElasticLevel:
    return replace(level, tau=tau)


def last_level_alone() -> Settings:
    """As many steps as all levels have, with the last stiffness from the beginning."""
    levels = ElasticOptions().levels
    return Settings(ElasticOptions(levels=(replace(levels[-1], steps=sum(level.steps for level in levels)),)))


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


def fewer_samples(step: int) -> Settings:
    """The default with every so manieth sample of the splat's surface."""

    def thin(view: SplatView) -> SplatView:
        samples, normals = view.surface.samples[::step], view.surface.sample_normals[::step]
        return replace(view, surface=replace(view.surface, samples=samples, sample_normals=normals))

    return Settings(view=thin)


def unsmoothed() -> Settings:
    """The centres nearest to the samples, and the normals of their planes, instead of smooth patches."""

    def as_they_are(view: SplatView) -> SplatView:
        nearest = cKDTree(view.surface.points).query(view.surface.samples)[1]
        points, normals = view.surface.points[nearest], view.surface.normals[nearest]
        return replace(view, surface=replace(view.surface, samples=points, sample_normals=normals))

    return Settings(view=as_they_are)


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
    "tau 0.12 from the beginning": robust_widths(0.12, 0.12, 0.12, 0.12),
    "tau 0.6: hardly robust": robust_widths(0.6, 0.6, 0.6, 0.6),
    "last alpha from the beginning": last_level_alone(),
    "scale of the start": Settings(scale_held=True),
    "every 2nd splat sample": fewer_samples(2),
    "every 4th splat sample": fewer_samples(4),
    "a quarter of the organ samples": Settings(ElasticOptions(organ_points=550)),
    "single centres without patches": unsmoothed(),
    "tissue held by tools kept": data(free_only=False),
    "data alike whatever is seen": Settings(ElasticOptions(seen_share=0.0)),
    "10 handles": basis(handles=10),
    "20 handles": basis(handles=20),
    "200 nodes": basis(nodes=200),
    "800 nodes": basis(nodes=800),
    "nu 0.35": basis(poissons_ratio=0.35),
}
