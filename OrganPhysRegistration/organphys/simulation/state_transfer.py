"""A state brought over to another basis of the same body, without turning tissue inside out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..ground.checks import InputError
from .body import Body
from .state import BodyState


def transferred(state: BodyState, old: Body, new: Body) -> BodyState:
    """The state of ``old`` on the basis of ``new``, a body of the same shape: nearest in the mass, contacts kept.

    Should that turn tissue inside out somewhere, it is drawn towards its affine part as far as needed. InputError if
    that is inside out as well.
    """
    points, volumes = new.shape.points, new.shape.volumes
    share = (volumes / volumes.sum())[:, None]
    project = new.basis.phi(points).T @ (share * old.basis.phi(points))
    moved = untangled(new, state.projected(project), first=4)
    if moved is None:
        raise InputError("state: the tissue is too distorted to be brought over; let it relax first")
    return moved


def untangled(body: Body, state: BodyState, *, first: int) -> BodyState | None:
    """The state with its coordinates from column ``first`` on shrunk until det F > 0; None if it never is."""
    for shrink in (1.0, 0.9, 0.7, 0.5, 0.3, 0.0):
        z = np.concatenate([state.z[:first], shrink * state.z[first:]])
        if body.strain.determinants(z).min() > 0:
            return state if shrink == 1 else replace(state, z=z)
    return None
