"""The .organphys-seq file: one zip with sequence.json, the first frame's asset and .npy arrays; no pickle, no dates."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..ground.atomic_file import write_bytes
from ..ground.checks import InputError
from .array_archive import archive_bytes, check_numbers, read_archive
from .asset_file import asset_bytes, asset_from_bytes, check_similarities
from .organ_sequence import OrganSequence

FORMAT, VERSION, HEADER = "organphys-sequence", 1, "sequence.json"
ENDING = ".organphys-seq"
ARRAYS = ("times", "z", "scales", "rotations", "translations")
FRAMES = "frame k: scene = T_scene_ct[k](undo(X + Phi(X) z[k])), T_scene_ct = scale rotation x + translation"


def save_sequence(sequence: OrganSequence, path: str | os.PathLike[str]) -> None:
    """Write the sequence to ``path``, atomically; the same sequence gives the same bytes."""
    write_bytes(path, sequence_bytes(sequence))


def sequence_bytes(sequence: OrganSequence) -> bytes:
    """The content of the .organphys-seq file."""
    arrays = {name: getattr(sequence, name) for name in ARRAYS}
    arrays |= {f"figures/{name.lower()}": np.asarray(values) for name, values in sequence.figures.items()}
    arrays["asset"] = np.frombuffer(asset_bytes(sequence.organ), dtype=np.uint8)
    header = {
        "format": FORMAT,
        "version": VERSION,
        "map": FRAMES,
        "time_unit": sequence.time_unit,
        "status": list(sequence.status),
        "notices": [[int(frame), message] for frame, message in sequence.notices],
        "figures": list(sequence.figures),
    }
    return archive_bytes(HEADER, header, arrays)


def load_sequence(path: str | os.PathLike[str]) -> OrganSequence:
    """The sequence of ``save_sequence``; InputError for a file that is missing, damaged, none, or newer."""
    header, arrays = read_archive(path, HEADER)
    if header.get("format") != FORMAT or not isinstance(header.get("version"), int):
        raise InputError(f"{path}: is no OrganPhys sequence; name a file that ends in {ENDING}")
    if header["version"] > VERSION:
        raise InputError(f"{path}: sequence version {header['version']} is newer than {VERSION}; update organphys")
    try:
        return _sequence(header, arrays, str(path))
    except (KeyError, TypeError, ValueError, IndexError, AttributeError, OverflowError) as error:
        raise InputError(f"{path}: damaged ({str(error)[:200]}); write or copy it again") from error


def _sequence(header: Mapping[str, Any], arrays: Mapping[str, np.ndarray], path: str) -> OrganSequence:
    check_numbers({name: arrays[name] for name in ARRAYS}, "sequence")
    sequence = OrganSequence(
        organ=asset_from_bytes(arrays["asset"].tobytes(), name=f"{path}: asset"),
        **{name: arrays[name] for name in ARRAYS},
        status=tuple(map(str, header["status"])),
        time_unit=str(header["time_unit"]),
        figures={str(name): arrays[f"figures/{str(name).lower()}"] for name in header["figures"]},
        notices=tuple((int(frame), str(message)) for frame, message in header["notices"]),
    )
    check_similarities(sequence.rotations, sequence.translations)
    if any(not 0 <= frame < len(sequence) for frame, _ in sequence.notices):
        raise InputError("a notice of a frame that is not there")
    return sequence
