"""Which mutation a file gets: by what it is, with the reader's whole corpus at hand."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Mapping

import numpy as np
from mutate_archive import mutate_archive
from mutate_bytes import Rng, mutate_bytes, pick
from mutate_grown import grown
from mutate_json import mutate_json
from mutate_lines import mutate_lines
from mutate_volume import mutate_nifti, mutate_packed_nifti, mutate_text_volume

MARK = b"end_header\n"
Mutation = Callable[[bytes, Rng], bytes]


def mutate_ply(content: bytes, rng: Rng) -> bytes:
    """Header lines, mostly; of an ASCII file also its rows."""
    at = content.find(MARK) + len(MARK)
    kind = rng.random()
    if at < len(MARK) or kind < 0.2:
        return mutate_bytes(content, rng)
    if kind < 0.75:
        return mutate_lines(content[:at], rng) + content[at:]
    body = content[at:]
    return content[:at] + (mutate_lines(body, rng) if b"format ascii" in content[:at] else mutate_bytes(body, rng))


def mutate_recording(content: bytes, rng: Rng) -> bytes:
    """An archive; in half of the cases its seal is made to fit again, as a forger would."""
    from seal import resealed

    out = mutate_archive(content, rng)
    return resealed(out) if rng.random() < 0.5 else out


def _text(structured: Mutation) -> Mutation:
    return lambda content, rng: (structured if rng.random() < 0.85 else mutate_bytes)(content, rng)


BY_ENDING: dict[str, Mutation] = {
    ".ply": mutate_ply,
    ".nii.gz": mutate_packed_nifti,
    ".nii": mutate_nifti,
    ".nrrd": mutate_text_volume,
    ".nhdr": mutate_text_volume,
    ".mha": mutate_text_volume,
    ".mhd": mutate_text_volume,
    ".json": _text(mutate_json),
    ".csv": _text(mutate_lines),
    ".fcsv": _text(mutate_lines),
    ".txt": _text(mutate_lines),
    ".organphys": mutate_archive,
    ".organphys-seq": mutate_archive,
    ".npz": mutate_archive,
    ".npy": mutate_bytes,
}


def seed_of_input(reader: str, campaign_seed: int, index: int) -> Rng:
    """The random numbers of one input: the same for the same three."""
    return np.random.default_rng([campaign_seed, zlib.crc32(reader.encode()), index])


def mutated(corpus: Mapping[str, bytes], rng: Rng) -> tuple[str, bytes]:
    """Name and content of one input: one in a hundred is a seed as it is, or one under another's name, one in five
    hundred a long one."""
    names = tuple(sorted(corpus))
    name = pick(rng, names)
    content, kind = corpus[name], rng.random()
    if kind < 0.005:
        return name, content
    if kind < 0.01:
        return name, corpus[pick(rng, names)]
    if kind < 0.012:
        return name, grown(name, content, rng)
    ending = next(e for e in BY_ENDING if name.endswith(e))
    return name, BY_ENDING[ending](content, rng)
