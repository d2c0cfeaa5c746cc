"""What assets, sequences, recordings and cases must be: finite everywhere, proper rotations, parts that fit."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterator
from typing import Any

import numpy as np

from organphys.asset.organ_sequence import OrganSequence
from organphys.asset.registered_organ import RegisteredOrgan
from organphys.points.point_sets import GaussianCloud
from organphys.simulation.session import Recording


def organ_problem(organ: RegisteredOrgan) -> str | None:
    similarity = organ.T_scene_ct
    if not _proper(similarity.rotation[None]):
        return "rotation"
    for name, value in _floats(organ):
        if not np.isfinite(value).all() and name != ".uncertainty.freedom":  # infinite: a Gaussian
            return f"{name} not finite"
    if not organ.volume_ml > 0 or not organ.normalisation.length > 0 or not organ.mm_per_unit > 0:
        return "volume, length or unit"
    organ.name.encode("utf-8")
    json.dumps([dict(organ.tissue), dict(organ.provenance)], ensure_ascii=False).encode("utf-8")
    x = organ.normalisation.apply(organ.vertices[:4])
    mapped = similarity.apply(organ.normalisation.undo(x + organ.basis.phi(x) @ organ.z))
    return None if np.isfinite(mapped).all() and mapped.shape == x.shape else "map"


def sequence_problem(sequence: OrganSequence) -> str | None:
    count = len(sequence)
    if not _proper(sequence.rotations):
        return "rotations"
    if any(not 0 <= frame < count for frame, _ in sequence.notices):
        return "a notice of a frame that is not there"
    if not np.isfinite(sequence.scene_vertices(count - 1)).all():
        return "vertices"
    return organ_problem(sequence.organ)


def recording_problem(recording: Recording) -> str | None:
    for name, value in _floats(recording.start):
        if not np.isfinite(value).all() and not name.endswith(("stiffness", "radius")):
            return f"{name} not finite"
    body = recording.start.scene.bodies[0]
    return None if np.isfinite(body.vertices(recording.start.state.bodies[0].z)).all() else "vertices"


def cloud_problem(cloud: GaussianCloud) -> str | None:
    count = len(cloud)
    if cloud.centres.shape != (count, 3) or cloud.opacities.shape != (count,) or cloud.valid.shape != (count,):
        return "shapes of the splat"
    seen = cloud.valid
    sound = (
        np.isfinite(cloud.centres[seen]).all() and ((cloud.opacities[seen] >= 0) & (cloud.opacities[seen] <= 1)).all()
    )
    return None if sound and cloud.colours.shape == (count, 3) else "numbers of the splat"


def _proper(rotations: np.ndarray) -> bool:
    with np.errstate(all="ignore"):
        square = rotations @ rotations.transpose(0, 2, 1)
        return bool(np.allclose(square, np.eye(3), atol=1e-5) and (np.linalg.det(rotations) > 0).all())


def _floats(value: Any, name: str = "", depth: int = 0) -> Iterator[tuple[str, np.ndarray]]:
    """Every array and number of a tree of records."""
    if depth > 12 or value is None or isinstance(value, (str, bytes)):
        return
    if isinstance(value, np.ndarray):
        if value.dtype.kind == "f":
            yield name, value
    elif isinstance(value, float):
        yield name, np.array(value)
    elif dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            yield from _floats(getattr(value, field.name), f"{name}.{field.name}", depth + 1)
    elif isinstance(value, tuple):
        for k, part in enumerate(value):
            yield from _floats(part, f"{name}.{k}", depth + 1)
