"""A zip of one JSON text and many .npy arrays: same content, same bytes; nothing is allocated on a file's mere word."""

from __future__ import annotations

import io
import os
import re
import struct
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.lib import format as npy

from ..ground.checks import LARGEST, InputError
from ..ground.npy_header import npy_header
from ..ground.plain_json import dump
from ..ground.strict_json import parse_json

MEMBER = re.compile(r"[a-z0-9_]{1,64}(/[a-z0-9_]{1,64})?\.npy")
DTYPES = ("<f8", "<f4", "<i8", "<i4", "|u1", "|b1")
MAX_MEMBERS = 4096
MAX_HEADER_BYTES = 64_000_000
MAX_ARRAY_HEADER = 10_000
BLOCK = 1 << 20


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
            header = parse_json(archive.read(header_name).decode("utf-8"))
            arrays = {m.filename.removesuffix(".npy"): _array(archive, m, file) for m in members}
    except InputError:
        raise
    except (
        *(zipfile.BadZipFile, ValueError, EOFError, KeyError, NotImplementedError, RuntimeError, struct.error),
        OverflowError,
    ) as error:
        raise InputError(f"{file}: not a whole archive ({str(error)[:160]}); write or copy it again") from error
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
    if archive.getinfo(header_name).file_size > MAX_HEADER_BYTES:
        raise _damaged(file, f"{header_name} is larger than {MAX_HEADER_BYTES // 1_000_000} MB")
    arrays = [m for m in members if m.filename != header_name]
    for member in arrays:
        if not MEMBER.fullmatch(member.filename):
            raise _damaged(file, f"unknown member {member.filename[:80]!r}")
    return arrays


def _array(archive: zipfile.ZipFile, member: zipfile.ZipInfo, file: Path) -> np.ndarray:
    """Array of one .npy member, read straight into its place; its declared size must be the size that is there."""
    with archive.open(member) as stream:
        header = npy_header(stream.read(MAX_ARRAY_HEADER))
        if header.dtype.str not in DTYPES or header.fortran:
            raise _damaged(file, f"{member.filename}: array type {header.dtype.str}")
        if header.size != member.file_size - header.offset:
            raise _damaged(file, f"{member.filename}: shape {header.shape} does not fit {member.file_size} bytes")
        array = np.empty(header.shape, header.dtype)
        stream.seek(header.offset)
        place, at = array.reshape(-1).view(np.uint8), 0
        while block := stream.read(BLOCK):  # to the end, where the checksum is compared
            place[at : at + len(block)] = np.frombuffer(block, np.uint8)
            at += len(block)
    return array


def _damaged(file: Path, what: str) -> InputError:
    return InputError(f"{file}: damaged ({what}); write or copy it again")


def check_numbers(arrays: Mapping[str, np.ndarray], what: str) -> None:
    """InputError where a number is not finite or beyond all that is stored."""
    for name, array in arrays.items():
        if array.dtype.kind == "f" and not (np.abs(array) <= LARGEST).all():
            raise InputError(f"{what}: array {name[:80]} holds numbers that are not finite or beyond {LARGEST:g}")
