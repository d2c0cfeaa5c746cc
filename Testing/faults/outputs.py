"""What lies where a command should write: whole, as before, or broken."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
from PIL import Image

from organphys.asset.asset_file import load_asset
from organphys.exports.recording_file import load_recording
from organphys.readers.gaussian_ply import read_gaussians

OLDER = "of an older run"
FOREIGN = "notes.txt"


def names_below(folder: Path) -> set[str]:
    """Files, with their places; hidden folders too, with a slash."""
    found = {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}
    return found | {f"{path.relative_to(folder)}/" for path in folder.rglob(".*") if path.is_dir()}


def damage(path: Path) -> str:
    """Why a file is not whole; empty if it is. Files of an older run are whole as they are."""
    try:
        if path.read_bytes() == OLDER.encode():
            return ""
        _read(path)
    except Exception as error:  # whatever a reader says of a file that should be whole
        return f"{path.name}: {type(error).__name__} {error}"
    return ""


def _read(path: Path) -> None:
    if path.suffix == ".organphys":
        load_asset(path)
    elif path.name == "recording.npz":
        load_recording(path)
    elif path.suffix == ".npz":
        with np.load(path) as archive:
            [archive[name] for name in archive.files]
    elif path.suffix == ".json":
        json.loads(path.read_text(encoding="utf-8"))
    elif path.suffix == ".ply":
        read_gaussians(path)
    elif path.suffix in (".png", ".gif"):
        with Image.open(path) as picture:
            for frame in range(getattr(picture, "n_frames", 1)):
                picture.seek(frame)
                picture.load()
    else:
        ends = {".vtp": b"</VTKFile>", ".html": b"</html>", ".csv": b"\n"}[path.suffix]
        if not path.read_bytes().rstrip(b" \r").endswith((ends, ends + b"\n")):
            raise ValueError("its end is missing")


def is_older(path: Path) -> bool:
    return path.read_bytes() == OLDER.encode()


def write_older(out: Path, names: set[str]) -> None:
    """What an older run would have left, and a file of someone else; ``out`` itself where the names are empty."""
    for path in [out / name for name in (*names, FOREIGN)] if names else [out]:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(OLDER)


def state(out: Path, names: set[str]) -> str:
    """ "absent", "older", "new", "between" (some of the new, none of the older: the next run finishes it), or what is
    wrong. ``names``: of a whole output folder, none for a file."""
    if not out.exists():
        return "absent"
    if not names:
        return damage(out) or ("older" if is_older(out) else "new")
    there = {name for name in names if (out / name).is_file()}
    wrong = [why for name in there if (why := damage(out / name))]
    others = {name for name in names_below(out) if not name.startswith(".")} - names - {FOREIGN}
    if wrong or others:
        return "; ".join([*wrong, *(f"{name} is in it" for name in others)])
    if (out / FOREIGN).exists() and not is_older(out / FOREIGN):
        return "a file of someone else has changed"
    older = {name for name in there if is_older(out / name)}
    if there == names and not older:
        return "new"
    if older and older != there:
        return f"older and new side by side: {sorted(older)} of {len(there)}"
    if older == names or (not there and not os.path.exists(out / FOREIGN)):
        return "older" if older else "absent"
    return "between"
