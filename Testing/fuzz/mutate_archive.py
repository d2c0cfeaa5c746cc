"""Mutations of a zip of one JSON member and .npy arrays: its members, their headers, their numbers, its directory."""

from __future__ import annotations

import io
import struct
import warnings
import zipfile
from functools import lru_cache

import numpy as np
from hostile import DTYPES, INTEGERS, MEMBER_NAMES
from mutate_bytes import Rng, mutate_bytes, pick
from mutate_json import mutate_json

Members = list[tuple[str, bytes]]
VALUES = (np.nan, np.inf, -np.inf, 1e308, -1e308, 1e-320, 0.0, -1.0, 1e13)


def mutate_archive(content: bytes, rng: Rng) -> bytes:
    """One or two edits of the members, written as a sound zip; or the zip itself damaged."""
    if rng.random() < 0.15:
        return _directory(content, rng) if rng.random() < 0.5 else mutate_bytes(content, rng)
    members = list(members_of(content))
    for _ in range(1 + int(rng.random() < 0.3)):
        members = _edited(members, rng)
    return zipped(members, deflated=rng.random() < 0.03)


@lru_cache(maxsize=4)
def members_of(content: bytes) -> tuple[tuple[str, bytes], ...]:
    """Name and content of every member."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        return tuple((info.filename, archive.read(info)) for info in archive.infolist())


def zipped(members: Members, *, deflated: bool = False) -> bytes:
    buffer = io.BytesIO()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of members with one name
        with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED if deflated else zipfile.ZIP_STORED) as archive:
            for name, data in members:
                archive.writestr(zipfile.ZipInfo(name), data)
    return buffer.getvalue()


def _edited(members: Members, rng: Rng) -> Members:
    if not members:
        return [("z.npy", b"")]
    members, at = list(members), int(rng.integers(len(members)))
    name, data = members[at]
    kind = rng.random()
    if kind < 0.3:
        at = next((k for k, (one, _) in enumerate(members) if one.endswith(".json")), at)
        members[at] = (members[at][0], mutate_json(members[at][1], rng))
    elif kind < 0.5:
        members[at] = (name, mutate_array(data, rng))
    elif kind < 0.62:
        members[at] = (name, _numbers(data, rng))
    elif kind < 0.7:
        members[at] = (name, members[int(rng.integers(len(members)))][1])
    elif kind < 0.78:
        del members[at]
    elif kind < 0.84:
        members.append((name, data))
    elif kind < 0.9:
        members[at] = (str(pick(rng, MEMBER_NAMES)), data)
    elif kind < 0.94:
        members.append((str(pick(rng, MEMBER_NAMES)), data))
    elif kind < 0.96:
        members[at] = (name, _nested(data, rng))
    else:
        members[at] = (name, mutate_bytes(data, rng))
    return members


def mutate_array(data: bytes, rng: Rng) -> bytes:
    """A .npy with another shape, type, order or version in its header, or with rows cut, doubled or emptied."""
    kind = rng.random()
    if kind < 0.4 and data[:6] == b"\x93NUMPY":
        try:
            array = load_member(data)
            return saved(_reshaped(array, rng))
        except (ValueError, EOFError, TypeError):
            return data[:-1]
    shape = ", ".join(str(pick(rng, INTEGERS)) for _ in range(int(rng.integers(0, 5))))
    descr = repr(pick(rng, DTYPES)) if rng.random() < 0.7 else "[('a', '<f8'), ('b', '|O')]"
    if kind < 0.6:
        header = data[10:].split(b"\n")[0].replace(b"(", b"(1, ", 1)
    elif kind < 0.9:
        header = f"{{'descr': {descr}, 'fortran_order': {rng.random() < 0.2}, 'shape': ({shape},), }}".encode()
    else:
        header = bytes(pick(rng, (b"-" * 9000 + b"1", b"(" * 150, b"{}", b"__import__('os').abort()", b"[" * 9000)))
    version = pick(rng, (b"\x01\x00", b"\x01\x00", b"\x01\x00", b"\x02\x00", b"\x03\x00", b"\x09\x00"))
    header = header[:65_000]
    length = struct.pack("<H" if version[0] == 1 else "<I", len(header) + 1)
    return b"\x93NUMPY" + version + length + header + b"\n" + data[data.find(b"\n") + 1 :]


def _reshaped(array: np.ndarray, rng: Rng) -> np.ndarray:
    kind = int(rng.integers(7))
    if kind == 0:
        return array[: int(rng.integers(0, len(array) + 1))] if array.ndim else array
    if kind == 1:
        return array.ravel()
    if kind == 2:
        return array.T
    if kind == 3:
        return np.concatenate([array, array]) if array.ndim else array
    if kind == 4:
        with np.errstate(all="ignore"):
            return array.astype(str(pick(rng, ("<f4", "<f8", "<i8", "<i4", "|u1", "|b1"))))
    return array[..., None] if kind == 5 else array[:0] if array.ndim else array


def _numbers(data: bytes, rng: Rng) -> bytes:
    """One number of the array exchanged; the file stays sound."""
    try:
        array = load_member(data).copy()
    except (ValueError, EOFError):
        return data
    if array.size:
        with np.errstate(all="ignore"):
            value = np.array(pick(rng, VALUES)).astype(array.dtype)
        array.ravel()[int(rng.integers(array.size))] = value
        if rng.random() < 0.2:
            array[...] = value
    return saved(array)


def _nested(data: bytes, rng: Rng) -> bytes:
    """An archive within an array (the asset of a sequence) mutated; other arrays get random bytes."""
    at = data.find(b"PK\x03\x04")
    if at < 0:
        return mutate_bytes(data, rng)
    inner = mutate_archive(data[at:], rng)
    return saved(np.frombuffer(inner, dtype=np.uint8))


def saved(array: np.ndarray) -> bytes:
    """The array as a .npy."""
    buffer = io.BytesIO()
    np.save(buffer, array, allow_pickle=False)
    return buffer.getvalue()


def _directory(content: bytes, rng: Rng) -> bytes:
    """Hostile words within the zip's central directory, where sizes and offsets stand."""
    at = content.find(b"PK\x01\x02")
    out = bytearray(content)
    for _ in range(int(rng.integers(1, 4))):
        k = int(rng.integers(max(at, 0), len(out)))
        word = struct.pack("<I", int(pick(rng, (0, 1, 2**16, 2**31, 2**32 - 1, len(content)))))
        out[k : k + 4] = word
    return bytes(out)


def load_member(data: bytes) -> np.ndarray:
    """The array of a .npy; ValueError where numpy, which evaluates the header as source, raises whatever it may."""
    try:
        array: np.ndarray = np.load(io.BytesIO(data), allow_pickle=False)
    except Exception as error:
        raise ValueError("no array") from error
    return array
