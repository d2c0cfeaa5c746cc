"""JSON from outside, within bounds: no nesting without end, no member twice, no number or text that cannot be kept."""

from __future__ import annotations

import json
from collections import Counter
from typing import Any, NoReturn

MAX_DEPTH = 100


def parse_json(text: str) -> Any:
    """The content of a JSON text; ValueError, in one line, for what is no JSON or goes beyond the bounds."""
    try:
        tree = json.loads(text, object_pairs_hook=_object, parse_constant=_no_number)
    except RecursionError as error:
        raise ValueError("nested too deeply") from error
    _check(tree)
    return tree


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    members = dict(pairs)
    if len(members) < len(pairs):
        (twice, _), *_ = Counter(name for name, _ in pairs).most_common(1)
        raise ValueError(f"member {twice[:40]!r} occurs twice")
    return members


def _no_number(name: str) -> NoReturn:
    raise ValueError(f"{name} is no number in JSON")


def _check(tree: Any) -> None:
    waiting, depth = [tree], 0
    while waiting:
        depth += 1
        if depth > MAX_DEPTH:
            raise ValueError("nested too deeply")
        below: list[Any] = []
        for value in waiting:
            if isinstance(value, dict):
                below += value.values()
                below += value
            elif isinstance(value, list):
                below += value
            elif isinstance(value, str) and not value.isascii():
                value.encode("utf-8")  # half of a surrogate pair is a ValueError
        waiting = below
