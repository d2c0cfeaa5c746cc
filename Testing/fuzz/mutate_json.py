"""Mutations of JSON: hostile values at any place, members left out, renamed, twice, and nesting without end."""

from __future__ import annotations

import copy
import json
from typing import Any

from hostile import JSON_VALUES, TEXTS, deep
from mutate_bytes import Rng, pick

Place = tuple[Any, Any]  # container and key


def mutate_json(content: bytes, rng: Rng) -> bytes:
    """One to three edits of the tree of values, and sometimes one of the text."""
    try:
        tree = json.loads(content)
    except (ValueError, RecursionError):
        return content
    for _ in range(1 + int(rng.random() < 0.4) + int(rng.random() < 0.2)):
        tree = edited(tree, rng)
    text = json.dumps(tree, ensure_ascii=bool(rng.random() < 0.5)) if rng.random() < 0.9 else json.dumps(tree, indent=1)
    if rng.random() < 0.1:
        text = _edited_text(text, rng)
    return text.encode("utf-8", errors="surrogatepass")


def edited(tree: Any, rng: Rng) -> Any:
    """The tree, changed in place: one value exchanged, left out, doubled or renamed."""
    found = places(tree)
    if not found:
        return pick(rng, JSON_VALUES)
    holder, key = found[int(rng.integers(len(found)))]
    kind = rng.random()
    if kind < 0.5:
        holder[key] = copy.deepcopy(pick(rng, JSON_VALUES))
    elif kind < 0.6:
        holder[key] = pick(rng, TEXTS)
    elif kind < 0.72:
        del holder[key]
    elif kind < 0.82 and isinstance(holder, list):
        holder[key:key] = [copy.deepcopy(holder[key])] * int(rng.integers(1, 50))
    elif kind < 0.9 and isinstance(holder, dict):
        holder[str(pick(rng, TEXTS))] = holder.pop(key)
    else:
        source, name = found[int(rng.integers(len(found)))]
        holder[key] = copy.deepcopy(source[name])
    return tree


def places(tree: Any) -> list[Place]:
    """Every value of a tree, as the container and its key."""
    out: list[Place] = []
    waiting = [tree]
    while waiting and len(out) < 3000:
        holder = waiting.pop()
        items = holder.items() if isinstance(holder, dict) else enumerate(holder) if isinstance(holder, list) else ()
        for key, value in items:
            out.append((holder, key))
            waiting.append(value)
    return out


def _edited_text(text: str, rng: Rng) -> str:
    kind, at = int(rng.integers(5)), int(rng.integers(len(text) + 1))
    depth = pick(rng, (50, 500, 5000, 100_000))
    if kind == 0:  # a member twice
        at = text.find('"', at)
        end = text.find(":", at)
        return text if at < 0 or end < 0 else f"{text[:at]}{text[at:end]}: {json.dumps(pick(rng, TEXTS))}, {text[at:]}"
    if kind == 1:
        at = text.find(":", at) + 1
        return text[:at] + deep("[", "]", depth) + text[text.find(",", at) :]
    if kind == 2:
        return deep('{"a":', "}", depth) if rng.random() < 0.5 else deep("[", "", depth)
    if kind == 3:
        return text[:at] + str(pick(rng, ("NaN", "1e400", "9" * 5000, "\\ud800", "/*", "\ufeff", "'"))) + text[at:]
    return text + text
