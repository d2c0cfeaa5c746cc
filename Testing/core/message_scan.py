"""Every message of the code to the user, found by reading its syntax trees; what is filled in at run time is "…".

Found are the texts of errors (InputError and what derives from it), of notices and of a verdict's reasons; what goes to
stderr; and, where texts are returned, those of functions named for it.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass

from doc_pages import ROOT
from message_texts import GAP, Source, name_of

FOLDERS = ("OrganPhysRegistration", "OrganPhysSimulation")
# Callables that take a message: the position of its code (None: it has none) and of its text.
TAKERS: dict[str, tuple[int | None, int]] = {
    "InputError": (None, 0), "Notice": (0, 1), "Reason": (0, 2), "_above": (0, 3),
    "_fail": (None, -1), "onStopped": (None, 0),
}  # fmt: skip
GIVERS = re.compile(r"(problems|warnings?|_messages|message_of|why_not|_told)$")  # functions that return messages
LEAST_LETTERS = 8


@dataclass(frozen=True)
class Message:
    """A text as it stands in the code, its code if it has one, and where: "file:line"; ``raised``: as an error, notice
    or reason, not shown in another way."""

    text: str
    code: str
    place: str
    raised: bool = False


def all_messages() -> list[Message]:
    """Every message of both modules."""
    files = [path for folder in FOLDERS for path in sorted((ROOT / folder).rglob("*.py"))]
    trees = {path: ast.parse(path.read_text(encoding="utf-8")) for path in files}
    own = {path: _constants(tree) for path, tree in trees.items()}
    imported = {name: value for constants in own.values() for name, value in constants.items()}
    classes = [node for tree in trees.values() for node in ast.walk(tree) if isinstance(node, ast.ClassDef)]
    derived = [node.name for node in classes if "InputError" in map(ast.unparse, node.bases)]
    takers = TAKERS | dict.fromkeys(derived, TAKERS["InputError"])
    return [m for path, tree in trees.items() for m in messages_in(Source(path, tree, imported | own[path]), takers)]


def _constants(tree: ast.Module) -> dict[str, ast.expr]:
    """A file's constants by their names in capitals."""
    named = [n for n in tree.body if isinstance(n, ast.Assign) and isinstance(n.targets[0], ast.Name)]
    return {n.targets[0].id: n.value for n in named if n.targets[0].id.isupper()}  # type: ignore[attr-defined]


def messages_in(source: Source, takers: dict[str, tuple[int | None, int]]) -> Iterator[Message]:
    for node in ast.walk(source.tree):
        if not isinstance(node, ast.Call):
            continue
        for word in node.keywords:
            if word.arg == "message":
                yield from _worded(source, word.value, "")
        taker = takers.get(name_of(node), (None, 0) if _to_stderr(node) else None)
        if taker is None or len(node.args) <= max(taker[1], 0):
            continue
        codes = [""] if taker[0] is None else source.texts(node.args[taker[0]])
        if len(codes) == 1:  # a call with several codes passes on what its own callers say
            raised = name_of(node) not in ("_fail", "onStopped", "print")
            yield from _worded(source, node.args[taker[1]], codes[0], raised=raised)
    for function in source.functions:
        if GIVERS.search(function.name):
            for node in ast.walk(function):
                if isinstance(node, ast.Return) and node.value is not None:
                    yield from _worded(source, node.value, "")
                elif isinstance(node, ast.Call) and name_of(node) == "append":
                    yield from _worded(source, node.args[0], "")


def _worded(source: Source, node: ast.expr, code: str, *, raised: bool = False) -> Iterator[Message]:
    """The texts of an expression that have words of their own; others pass on what stands elsewhere."""
    for text in source.texts(node):
        text = " ".join(text.split()).removeprefix("organphys: ")
        if sum(letter.isalpha() for letter in text) >= LEAST_LETTERS and " " in text:
            place = f"{source.path.relative_to(ROOT)}:{node.lineno}"
            yield Message(text, "" if GAP in code else code, place, raised)


def _to_stderr(call: ast.Call) -> bool:
    return name_of(call) == "print" and any("stderr" in ast.unparse(word.value) for word in call.keywords)
