"""Local functions that follow the contact: when they are made, moved and dropped, and the state that goes with them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.distance import cdist

from ..ground.checks import Array
from .body import Body
from .local_detail import LocalDetail, kernels_near, with_kernels
from .local_functions import LocalFunctions
from .simulation_basis import LocalColumns
from .state import BodyState

AT_REST = 5e-5  # m: kernels that carry less are dropped when the contact has gone or moved on
MOST = 2  # times the count of the detail: so many kernels at most, without those that carry least
SAME = 1e-9  # m
UNSEEN, UNFELT = 2e-4, 2e-5  # m: a change of functions may move the surface so far, and what a tool touches
LEFT_BEHIND = (
    1e-3  # m: kernels that carry more are not dropped; they give it up by themselves once nothing presses there
)


def followed(body: Body, state: BodyState, detail: LocalDetail) -> tuple[Body, BodyState]:
    """Body and state with local functions made or moved where the contact asks for it, and dropped once at rest.

    They stay as they are while a change would turn tissue inside out or move it visibly.
    """
    centre, local, new = contact_centre(body, state), body.basis.local, body
    if centre is None:
        if local is not None and _dimple(body, state) < AT_REST:
            new = body.plain or body
    elif local is None or np.linalg.norm(local.functions.middle - centre) > detail.follow * detail.radius:
        kernels = _next_kernels(body, state, centre, detail)
        if kernels is not None:
            new = with_kernels(body, kernels)
    if new is body:
        return body, state
    moved, felt = _still_where_touched(detail_state(state, body, new), new, state, body)
    sound = felt < UNFELT and _shift(body, state.z, new, moved.z) < UNSEEN
    sound = sound and new.strain.determinants(moved.z).min() > 0.5 * body.strain.determinants(state.z).min()
    return (new, moved) if sound else (body, state)


def _still_where_touched(moved: BodyState, new: Body, state: BodyState, old: Body) -> tuple[BodyState, float]:
    """The state with the least local change that keeps touched samples in place, and how far they move still, m.

    A tool would push hard what a change of functions has moved into it.
    """
    local, samples = new.basis.local, np.unique(state.touch.sample)
    if local is None or not len(samples):
        return moved, 0.0
    n = new.basis.mixing.shape[1]
    phi, wanted = new.sample_phi(samples), old.sample_positions(state.z, samples)
    missing = wanted - new.samples.points[samples] - phi @ moved.z
    least = np.linalg.pinv(phi[:, n:], rcond=1e-2) @ missing
    z = np.concatenate([moved.z[:n], moved.z[n:] + least])
    return replace(moved, z=z), _largest(missing - phi[:, n:] @ least)


def detail_state(state: BodyState, old: Body, new: Body) -> BodyState:
    """The state of ``old`` for ``new``, which differs in its local functions: exact for functions that both have.

    What the others carried is projected in the mass.
    """
    n = old.basis.mixing.shape[1]
    project = np.zeros((new.basis.size, old.basis.size))
    project[:n, :n] = np.eye(n)
    if old.basis.local is not None and new.basis.local is not None:
        project[:n, n:], project[n:, n:] = _carried(old, old.basis.local, new.basis.local)
    return state.projected(project)


def _carried(old: Body, theirs: LocalColumns, ours: LocalColumns) -> tuple[Array, Array]:
    """Base (n, k) and local coordinates (k', k) that the old local columns have on the new basis.

    A column is functions times mixing minus base columns times overlap; kept functions keep their coefficients.
    """
    same = cdist(ours.functions.centres, theirs.functions.centres) < SAME
    local = np.linalg.pinv(ours.mixing) @ (same @ theirs.mixing)
    base = ours.overlap @ local - theirs.overlap
    gone = ~same.any(0)
    if gone.any():
        points, share = old.strain.points, old.strain.weights / old.strain.weights.sum()
        functions = theirs.functions
        lost = LocalFunctions(functions.centres[gone], functions.radius, functions.middle).values(points)
        products = ours.functions.values(points).T @ (share[:, None] * lost)
        overlap = (theirs.overlap @ np.linalg.pinv(theirs.mixing))[:, gone]
        local = local + (ours.mixing.T @ products - ours.overlap.T @ overlap) @ theirs.mixing[gone]
        base = base + overlap @ theirs.mixing[gone]
    return base, local


def contact_centre(body: Body, state: BodyState) -> Array | None:
    """Rest position (3,) m of the middle of all contacts and grips, weighted by force and area; None: no contact."""
    samples, weights = state.touch.sample, state.touch.force
    held = [grip.sample for grip in state.grips if len(grip.sample)]
    if held:
        samples = np.concatenate(held)
        weights = body.samples.areas[samples]
    if not len(samples) or not weights.sum() > 0:
        return None
    middle: Array = weights @ body.samples.points[samples] / weights.sum()
    return middle


def _next_kernels(body: Body, state: BodyState, centre: Array, detail: LocalDetail) -> LocalFunctions | None:
    """The kernels wanted round ``centre`` and those of before that still carry something; None: that is too many."""
    fresh, local = kernels_near(body, centre, detail), body.basis.local
    if local is None:
        return fresh
    old = local.functions.centres
    carries = np.sqrt(((local.mixing @ state.z[body.basis.mixing.shape[1] :]) ** 2).sum(1))
    extra = (carries > AT_REST) & (cdist(old, fresh.centres) >= SAME).all(1)
    room = max(int(MOST * detail.count) - len(fresh.centres), 0)
    order = [k for k in np.argsort(-carries, kind="stable") if extra[k]]
    chosen, dropped = order[:room], order[room:]
    if dropped and carries[dropped[0]] > LEFT_BEHIND:
        return None
    return LocalFunctions(np.concatenate([fresh.centres, old[sorted(chosen)]]), fresh.radius, fresh.middle)


def _dimple(body: Body, state: BodyState) -> float:
    """Largest displacement of the middles of patches of contact samples by the local functions, m."""
    n = body.basis.mixing.shape[1]
    return _largest(body.middle_phi[:, n:] @ state.z[n:])


def _shift(old: Body, z: Array, new: Body, moved: Array) -> float:
    """How far a change of functions moves the middles of patches of contact samples at most, m."""
    return _largest(new.middle_phi @ moved - old.middle_phi @ z)


def _largest(way: Array) -> float:
    return float(np.sqrt((way**2).sum(1).max(initial=0.0)))
