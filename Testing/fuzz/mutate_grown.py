"""Files that are long in one place: a line, word, column, list or member a thousandfold, up to two megabytes.

What takes a time that grows with the square of a length is found by these, or by none of the short ones.
"""

from __future__ import annotations

import json
import re
from typing import Any

import numpy as np
from mutate_archive import load_member, members_of, saved, zipped
from mutate_bytes import Rng, pick
from mutate_json import places

SIZES = (100_000, 400_000, 2_000_000)  # bytes
WORD = re.compile(rb"[^\s,:;=()]+")


def grown(name: str, content: bytes, rng: Rng) -> bytes:
    """The content of a seed, long in one place."""
    size = int(pick(rng, SIZES))
    if name.endswith((".organphys", ".organphys-seq", ".npz")):
        return _archive(content, size, rng)
    if name.endswith(".json"):
        return _json(content, size, rng)
    at = content.find(b"end_header\n")
    head = content if at < 0 or rng.random() < 0.3 else content[:at]
    return _lines(head, size, rng) + content[len(head) :]


def _lines(content: bytes, size: int, rng: Rng) -> bytes:
    """One line, or one word or number of it, many times; numbered in half of the cases, so that all differ."""
    lines = content.split(b"\n")
    at, numbered = int(rng.integers(min(len(lines), 40))), rng.random() < 0.5
    words = list(WORD.finditer(lines[at]))
    if rng.random() < 0.4 or not words:
        lines[at] = _many(lines[at], b"\n", size, numbered)
    else:
        word = words[int(rng.integers(len(words)))]
        between = pick(rng, (b",", b" ", b";", b"\t", b""))
        lines[at] = lines[at][: word.start()] + _many(word[0], between, size, numbered) + lines[at][word.end() :]
    return b"\n".join(lines)


def _many(part: bytes, between: bytes, size: int, numbered: bool) -> bytes:
    count = max(2, size // (len(part) + len(between) + 6 * numbered + 1))
    return between.join(part + b"%d" % k if numbered else part for k in range(count))


def _json(content: bytes, size: int, rng: Rng) -> bytes:
    """A value many times in its list, a member under many names, or a long text."""
    tree = json.loads(content)
    found = places(tree)
    if not found:
        return content
    holder, key = found[int(rng.integers(len(found)))]
    one: Any = holder[key]
    count = max(2, size // (len(json.dumps(one)) + 4))
    if isinstance(one, str) and rng.random() < 0.7:
        holder[key] = pick(rng, (one or "a", " ", "1", "r=", "\u00e9")) * size
    elif isinstance(holder, list):
        holder[key:key] = [one] * count
    elif isinstance(one, list) and one:
        holder[key] = one * max(2, count)
    else:
        holder |= {f"{key}{k}": one for k in range(count // 2)}
    return json.dumps(tree).encode("utf-8", errors="surrogatepass")


def _archive(content: bytes, size: int, rng: Rng) -> bytes:
    """A member long, or very many members."""
    members, kind = list(members_of(content)), rng.random()
    if kind < 0.2:
        count = size // 200
        return zipped([*members, *((f"n{k}.npy", saved(np.zeros(1))) for k in range(count))])
    at = int(rng.integers(len(members))) if kind < 0.6 else 0
    at = next((k for k, (one, _) in enumerate(members) if one.endswith(".json")), at) if kind >= 0.6 else at
    name, data = members[at]
    if name.endswith(".json"):
        data = _json(data, size, rng)
    else:
        array = load_member(data)
        if array.ndim and array.size:
            data = saved(np.concatenate([array] * max(2, size // array.nbytes)))
    members[at] = (name, data)
    return zipped(members)
