"""The body of a registered organ: an own basis on the geometry after registration, in metres along the scene's axes."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..asset.registered_organ import RegisteredOrgan
from ..ground.checks import Array, as_vector
from ..mechanics.tissue import Tissue, tissue_for
from .blas_threads import one_blas_thread
from .body import Body, build_body
from .pins import AnyPin
from .rest_shape import rest_shape


def metres_per_unit(organ: RegisteredOrgan) -> float:
    """Metres per scene unit by the registration's scale: 1 mm of CT is 1 mm of tissue."""
    return 1e-3 / organ.T_scene_ct.scale


@one_blas_thread
def organ_body(
    organ: RegisteredOrgan,
    *,
    pins: tuple[AnyPin, ...] = (),
    tissue: Tissue | None = None,
    handles: int = 20,
    quadrature: int = 2000,
    sample_spacing: float = 1e-3,
    seed: int = 0,
) -> Body:
    """Body of the organ as registered; ``tissue``: the preset that goes with the organ's name if not given.

    Positions are scene coordinates times ``metres_per_unit``. See ``rest_shape`` for the other arguments.
    """
    tissue = tissue or tissue_for(organ.name)
    unit = metres_per_unit(organ)
    u, slope = organ.deformation.inside(organ.volume_points)  # without baking the field beside the organ
    points = organ.T_scene_ct.apply(organ.volume_points + u) * unit
    stretch = np.linalg.det(slope + np.eye(3))
    volumes = 1e-6 * organ.volume_ml * stretch / len(points)
    shape = rest_shape(
        points,
        volumes,
        organ.scene_vertices * unit,
        organ.faces,
        tissue=tissue,
        handles=handles,
        quadrature=quadrature,
        sample_spacing=sample_spacing,
        seed=seed,
    )
    return build_body(shape, pins=pins, tissue=tissue, name=organ.name)


def scene_direction(organ: RegisteredOrgan, direction_ras: ArrayLike) -> Array:
    """A CT direction (3,), RAS, along the scene's axes: (0, -1, 0) is down for a patient who lies on the back."""
    return organ.T_scene_ct.turn(as_vector(direction_ras, "direction"))
