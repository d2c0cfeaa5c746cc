"""A zip of one JSON text and many .npy arrays: same content, same bytes; nothing is allocated on a file's mere word."""

from __future__ import annotations

import io
import json
import os
import re
import struct
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.lib import format as npy

from ..ground.checks import InputError
from ..ground.plain_json import dump

MEMBER = re.compile(r"[a-z0-9_]{1,64}(/[a-z0-9_]{1,64})?\.npy")
DTYPES = ("<f8", "<f4", "<i8", "<i4", "|u1", "|b1")
MAX_MEMBERS = 4096


def archive_bytes(header_name: str, header: Any, arrays: Mapping[str, np.ndarray], *, sort_keys: bool = True) -> bytes:
    """``header`` as JSON member ``header_name`` and every array as NAME.npy: stored, sorted, without dates."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_STORED) as archive:
        _add(archive, header_name, dump(header, sort_keys=sort_keys).encode("utf-8"))
        for name in sorted(arrays):
            array = np.asarray(arrays[name], order="C")
            member = io.BytesIO()
            npy.write_array(member, array.astype(array.dtype.newbyteorder("<"), copy=False), allow_pickle=False)
            _add(archive, f"{name}.npy", member.getvalue())
    return buffer.getvalue()


def read_archive(path: str | os.PathLike[str], header_name: str) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Header and arrays; InputError for what is missing, truncated, damaged, compressed or not plain numbers."""
    file = Path(path)
    try:
        size = file.stat().st_size
        with file.open("rb") as stream:
            return _read(stream, size, file, header_name)
    except OSError as error:
        raise InputError(f"{file}: cannot be read ({error.strerror or error}); check the path") from error


def read_archive_bytes(content: bytes, name: str, header_name: str) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """The same of an archive in memory; ``name``: what errors call it."""
    return _read(io.BytesIO(content), len(content), Path(name), header_name)


def _read(stream: BinaryIO, size: int, file: Path, header_name: str) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    try:
        with zipfile.ZipFile(stream) as archive:
            members = _checked_members(archive, size, file, header_name)
            header = json.loads(archive.read(header_name).decode("utf-8"))
            arrays = {m.filename.removesuffix(".npy"): _array(archive.read(m), file, m.filename) for m in members}
    except InputError:
        raise
    except (
        zipfile.BadZipFile,
        ValueError,
        EOFError,
        KeyError,
        NotImplementedError,
        RuntimeError,
        struct.error,
    ) as error:
        raise InputError(f"{file}: not a whole archive ({error}); write or copy it again") from error
    if not isinstance(header, dict):
        raise _damaged(file, f"{header_name} holds no object")
    return header, arrays


def _add(archive: zipfile.ZipFile, name: str, content: bytes) -> None:
    info = zipfile.ZipInfo(name, date_time=(1980, 1, 1, 0, 0, 0))
    info.create_system, info.external_attr = 3, 0o644 << 16  # the same bytes on every system
    archive.writestr(info, content, zipfile.ZIP_STORED)


def _checked_members(archive: zipfile.ZipFile, size: int, file: Path, header_name: str) -> list[zipfile.ZipInfo]:
    """The array members, once names and declared sizes are known to be sound."""
    members = archive.infolist()
    names = [m.filename for m in members]
    if header_name not in names or len(set(names)) != len(names) or len(names) > MAX_MEMBERS:
        wanted = "an .organphys file" if header_name == "organ.json" else "one that organphys wrote"
        raise InputError(f"{file}: is not what is read here (no unique {header_name} in it); name {wanted}")
    if sum(m.file_size for m in members) > size or any(m.compress_type != zipfile.ZIP_STORED for m in members):
        raise _damaged(file, "members larger than the file, or compressed")
    arrays = [m for m in members if m.filename != header_name]
    for member in arrays:
        if not MEMBER.fullmatch(member.filename):
            raise _damaged(file, f"unknown member {member.filename[:80]!r}")
    return arrays


def _array(content: bytes, file: Path, name: str) -> np.ndarray:
    """Array of one .npy member; its declared size must be the size that is there."""
    stream = io.BytesIO(content)
    version = npy.read_magic(stream)
    if version != (1, 0):
        raise _damaged(file, f"{name}: array format {version}")
    shape, fortran, dtype = npy.read_array_header_1_0(stream)
    if dtype.str not in DTYPES or fortran:
        raise _damaged(file, f"{name}: array type {dtype.str}")
    count = 1
    for length in shape:
        count *= length
    if count * dtype.itemsize != len(content) - stream.tell():
        raise _damaged(file, f"{name}: shape {shape} does not fit its {len(content)} bytes")
    return np.frombuffer(content, dtype, count, stream.tell()).reshape(shape).copy()


def _damaged(file: Path, what: str) -> InputError:
    return InputError(f"{file}: damaged ({what}); write or copy it again")
