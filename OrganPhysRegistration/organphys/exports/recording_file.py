"""A recording of a simulation as an .npz that ``numpy.load`` opens too: bodies, tools, start and all that was done.

The header member recording.json holds the records; moves are stacked: move_dt (M,) s, move_position (M, T, 3) m,
move_rotation (M, T, 3, 3), move_jaw_deg (M, T) and move_shaft_rotation (M, T, 3, 3), NaN where the shaft turns with the
tool, for M steps and T tools, in scene axes. No pickle, no code. A seal over all of it tells whether anything was
changed since: nobody edits a recording, and one that was edited would replay another simulation.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping, Sequence
from itertools import groupby
from typing import Any

import numpy as np

from .. import __version__
from ..asset.array_archive import archive_bytes, read_archive
from ..ground.atomic_file import write_bytes
from ..ground.checks import Array, InputError
from ..ground.plain_json import plain
from ..simulation.local_detail import LocalDetail
from ..simulation.options import SimulationOptions
from ..simulation.record_tree import RecordTable, record_of
from ..simulation.session import Event, Move, PinEdit, Recording, Snapshot
from ..simulation.state import ToolPose

FORMAT, VERSION, HEADER = "organphys-recording", 2, "recording.json"  # 2: sealed


def save_recording(path: str | os.PathLike[str], recording: Recording) -> None:
    """Write the recording to ``path``, atomically; the same recording gives the same bytes.

    Some 25 MB per body. InputError where it cannot be written.
    """
    table = RecordTable()
    header = {
        "format": FORMAT,
        "version": VERSION,
        "organphys": __version__,
        "start": table.tree(recording.start),
        "detail": table.tree(recording.detail),
        "events": _event_trees(recording.events, table),
    }
    moves = [event for event in recording.events if isinstance(event, Move)]
    tools = len(recording.start.scene.tools)
    arrays = {**table.arrays, **_stacked(moves, tools)}
    write_bytes(path, archive_bytes(HEADER, {**header, "seal": seal(header, arrays)}, arrays))


def seal(header: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> str:
    """SHA-256 over the header, without its seal, and all arrays with their names, types and shapes."""
    digest = hashlib.sha256(json.dumps(plain(header), sort_keys=True).encode())
    for name in sorted(arrays):
        array = np.asarray(arrays[name], order="C")
        digest.update(f"{name} {array.dtype.str} {array.shape} ".encode())
        digest.update(array.tobytes())
    return digest.hexdigest()


def load_recording(path: str | os.PathLike[str]) -> Recording:
    """The recording written by ``save_recording``; on the machine that wrote it, it replays bit for bit.

    InputError for a file that is missing, damaged, no recording, or of another version.
    """
    header, arrays = read_archive(path, HEADER)
    if header.get("format") != FORMAT:
        raise InputError(f"{path}: is no recording of a simulation; name an .npz that a simulation wrote")
    if header.get("version") != VERSION:
        raise InputError(
            f"{path}: recording of version {header.get('version')}, not {VERSION} as this organphys reads; record again"
        )
    if header.pop("seal", None) != seal(header, arrays):
        raise InputError(f"{path}: changed since it was recorded, its seal does not fit; copy it again or record again")
    try:
        start, detail = (record_of(header[name], arrays) for name in ("start", "detail"))
        events = _events(header["events"], arrays)
        return _checked(Recording(start, events, detail))
    except (KeyError, TypeError, ValueError, IndexError, AttributeError) as error:
        made_by = str(header.get("organphys"))[:20]
        raise InputError(
            f"{path}: damaged, or written by another organphys ({made_by}): {error}; record again"
        ) from error


def _event_trees(events: Sequence[Event], table: RecordTable) -> list[Any]:
    """Runs of moves as their number, every other event as a tree."""
    out: list[Any] = []
    for is_move, run in groupby(events, key=lambda event: isinstance(event, Move)):
        trees = [None if is_move else table.tree(event) for event in run]
        out += [len(trees)] if is_move else trees
    return out


def _stacked(moves: Sequence[Move], tools: int) -> dict[str, np.ndarray]:
    poses, rows = [pose for move in moves for pose in move.poses], (len(moves), tools)
    none = np.full((3, 3), np.nan)
    shafts = [none if p.shaft_rotation is None else p.shaft_rotation for p in poses]
    return {
        "move_dt": np.array([move.dt for move in moves], dtype=np.float64),
        "move_position": np.array([p.position for p in poses], dtype=np.float64).reshape(*rows, 3),
        "move_rotation": np.array([p.rotation for p in poses], dtype=np.float64).reshape(*rows, 3, 3),
        "move_jaw_deg": np.array([p.jaw_deg for p in poses], dtype=np.float64).reshape(rows),
        "move_shaft_rotation": np.array(shafts, dtype=np.float64).reshape(*rows, 3, 3),
    }


def _events(trees: Sequence[Any], arrays: Mapping[str, np.ndarray]) -> tuple[Event, ...]:
    names = ("dt", "position", "rotation", "jaw_deg", "shaft_rotation")
    dt, *rest = (arrays[f"move_{name}"] for name in names)
    count, tools = rest[2].shape
    if [part.shape for part in (dt, *rest)] != [
        (count,), (count, tools, 3), (count, tools, 3, 3), (count, tools), (count, tools, 3, 3),
    ]:  # fmt: skip
        raise InputError("the moves have arrays of different lengths")
    if sum(tree for tree in trees if isinstance(tree, int)) != count:
        raise InputError("the events name another number of moves than there are")
    moves = iter(
        Move(tuple(_pose(*tool) for tool in zip(*step, strict=True)), float(seconds))
        for seconds, *step in zip(dt, *rest, strict=True)
    )
    out: list[Event] = []
    for tree in trees:
        out += [next(moves) for _ in range(tree)] if isinstance(tree, int) else [record_of(tree, arrays)]
    return tuple(out)


def _pose(position: Array, rotation: Array, jaw_deg: float, shaft: Array) -> ToolPose:
    turned = None if np.isnan(shaft).any() else shaft.copy()
    return ToolPose(position.copy(), rotation.copy(), float(jaw_deg), turned)


def _checked(recording: Recording) -> Recording:
    """The recording, once its parts fit together."""
    start = recording.start
    if not isinstance(start, Snapshot) or not isinstance(recording.detail, (LocalDetail, type(None))):
        raise InputError("the start is no snapshot")
    scene, state = start
    tools = len(scene.tools)
    if len(state.bodies) != len(scene.bodies) or len(state.tools) != tools:
        raise InputError("scene and state have different numbers of bodies or tools")
    for body, now in zip(scene.bodies, state.bodies, strict=True):
        if any(part.shape != (body.basis.size, 3) for part in (now.z, now.velocity, now.z_before, now.reference)):
            raise InputError(f"the state of {body.name} does not fit its basis")
    for event in recording.events:
        if not isinstance(event, (Move, PinEdit, SimulationOptions)):
            raise InputError(f"{type(event).__name__} is no event")
        if isinstance(event, Move):
            scene.checked_poses(event.poses)
    return recording
