"""Smaller settings of the default method, so that a registration in a test takes a second."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from functools import partial

import pytest

from organphys.align.start_candidates import CandidateOptions
from organphys.align.start_search import StartSearchOptions, search_start
from organphys.elastic.reduced_organ import ReducedOrganOptions, reduce_organ
from organphys.pipeline import default_method
from organphys.points.surface_samples import sample_surface

FEWER = StartSearchOptions(candidates=CandidateOptions(views=80, twists=12, factors=(0.92, 1.15)))
COARSER = ReducedOrganOptions(handles=6, nodes=200, basis_samples=1500, quadrature=600)
FEWEST = StartSearchOptions(candidates=CandidateOptions(views=40, twists=8, factors=(1.0,)))
COARSEST = ReducedOrganOptions(handles=5, nodes=120, basis_samples=800, quadrature=250)


def small_problem() -> AbstractContextManager[None]:
    """Fewer candidates, samples and handles: these tests are about what is made of the inputs."""
    return _problem(FEWER, 2500, COARSER)


def tiny_problem() -> AbstractContextManager[None]:
    """Fewer still, about half the time: for tests that compare runs with each other and ask for no accuracy."""
    return _problem(FEWEST, 1000, COARSEST)


@contextmanager
def _problem(search: StartSearchOptions, samples: int, organ: ReducedOrganOptions) -> Iterator[None]:
    patch = pytest.MonkeyPatch()
    patch.setattr(default_method, "search_start", partial(search_start, options=search))
    patch.setattr(default_method, "sample_surface", partial(sample_surface, count=samples))
    patch.setattr(default_method, "reduce_organ", partial(reduce_organ, options=organ))
    yield
    patch.undo()
