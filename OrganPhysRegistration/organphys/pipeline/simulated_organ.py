"""The body of an organ from the words of the command line: asset, tissue, pins."""

from __future__ import annotations

import argparse

import numpy as np

from ..asset.registered_organ import RegisteredOrgan
from ..ground.checks import Array, InputError
from ..mechanics.tissue import PRESETS, Tissue
from ..readers.pins_file import PinMarks, read_pins
from ..simulation.body import Body
from ..simulation.organ_body import metres_per_unit, organ_body
from ..simulation.pins import Pin


def body_from_options(
    organ: RegisteredOrgan, arguments: argparse.Namespace, *, otherwise: tuple[Pin, ...] = ()
) -> Body:
    """The organ's body with --tissue, --pins (``otherwise`` without them), --handles and --quadrature."""
    if arguments.quadrature < 50:
        raise InputError(f"--quadrature: expected at least 50 points, got {arguments.quadrature}")
    pins = otherwise
    if arguments.pins is not None:
        pins = pins_in_metres(organ, read_pins(arguments.pins, radius_mm=arguments.pin_radius_mm))
    tissue = tissue_named(arguments.tissue)
    return organ_body(organ, pins=pins, tissue=tissue, handles=arguments.handles, quadrature=arguments.quadrature)


def tissue_named(name: str | None) -> Tissue | None:
    """A preset by its name; None: the one that goes with the organ."""
    if name is None:
        return None
    if name.lower() not in PRESETS:
        raise InputError(f"--tissue: expected one of {', '.join(PRESETS)}, got {name!r}")
    return PRESETS[name.lower()]


def pins_in_metres(organ: RegisteredOrgan, marks: PinMarks) -> tuple[Pin, ...]:
    """Pins of the simulation's scene (m) from marks in CT RAS mm."""
    centres = organ.map_points(marks.centres) * metres_per_unit(organ)
    return tuple(Pin(tuple(c), 1e-3 * float(r)) for c, r in zip(centres.tolist(), marks.radii_mm, strict=True))


def camera_of(organ: RegisteredOrgan) -> Array:
    """Camera (3,) in scene units as the registration was told, the origin if the asset does not say."""
    options = organ.provenance.get("options", {})
    camera = options.get("camera") if hasattr(options, "get") else None
    place = np.zeros(3) if camera is None else np.asarray(camera, dtype=np.float64)
    return place if place.shape == (3,) and np.isfinite(place).all() else np.zeros(3)
