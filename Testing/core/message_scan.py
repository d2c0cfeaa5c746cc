"""Every message of the code to the user, found by reading its syntax trees; what is filled in at run time is "…".

Found are the texts of errors (InputError and what derives from it), of notices and of a verdict's reasons; what goes to
stderr; and, where texts are returned, those of functions named for it. A text made elsewhere is followed one step: a
name to its assignment, a parameter to the calls of its function.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from doc_pages import ROOT

FOLDERS = ("OrganPhysRegistration", "OrganPhysSimulation")
GAP = "…"
# Callables that take a message: the position of its code (None: it has none) and of its text.
TAKERS: dict[str, tuple[int | None, int]] = {
    "InputError": (None, 0), "DependencyError": (None, 0), "Notice": (0, 1), "Reason": (0, 2), "_above": (0, 3),
    "_fail": (None, -1), "onStopped": (None, 0),
}  # fmt: skip
GIVERS = re.compile(r"(problems|warnings?|_messages|one_line|why_not|_told)$")  # functions that return messages
LEAST_LETTERS = 8


@dataclass(frozen=True)
class Message:
    """A text as it stands in the code, its code if it has one, and where: "file:line"; ``raised``: as an error, notice
    or reason, not shown in another way."""

    text: str
    code: str
    place: str
    raised: bool = False


@dataclass(frozen=True)
class Source:
    """One file: its functions, innermost first, and the texts that its names stand for."""

    path: Path
    tree: ast.Module
    constants: dict[str, ast.expr] = field(default_factory=dict)

    @cached_property
    def functions(self) -> list[ast.FunctionDef]:
        found = [node for node in ast.walk(self.tree) if isinstance(node, ast.FunctionDef)]
        return sorted(found, key=lambda node: (node.end_lineno or 0) - node.lineno)

    def around(self, node: ast.AST) -> ast.FunctionDef | None:
        """The innermost function that holds a node."""
        line = node.lineno  # type: ignore[attr-defined]
        return next((f for f in self.functions if f.lineno <= line <= (f.end_lineno or 0)), None)

    def texts(self, node: ast.expr, depth: int = 0) -> list[str]:
        """The texts an expression can give."""
        if isinstance(node, ast.Constant):
            return [node.value] if isinstance(node.value, str) else [GAP]
        if isinstance(node, ast.JoinedStr):
            return ["".join(part.value if isinstance(part, ast.Constant) else GAP for part in node.values)]  # type: ignore[misc]
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
            return [a + b for a in self.texts(node.left, depth) for b in self.texts(node.right, depth)]
        if isinstance(node, ast.IfExp):
            return self.texts(node.body, depth) + self.texts(node.orelse, depth)
        if isinstance(node, ast.Subscript):
            return self.texts(node.value, depth)
        if isinstance(node, (ast.Tuple, ast.List)):
            return [text for element in node.elts for text in self.texts(element, depth)]
        if isinstance(node, ast.Call):
            return self._of_call(node, depth)
        if isinstance(node, ast.Name) and depth < 3:
            return self._of_name(node, depth + 1)
        return [GAP]

    def _of_call(self, node: ast.Call, depth: int) -> list[str]:
        """_("text"), "text {gap}".format(...)."""
        name = name_of(node)
        if name in ("_", "tr") and node.args:
            return self.texts(node.args[0], depth)
        if name == "format" and isinstance(node.func, ast.Attribute):
            return [re.sub(r"\{[^}]*\}", GAP, text) for text in self.texts(node.func.value, depth)]
        return [GAP]

    def _of_name(self, node: ast.Name, depth: int) -> list[str]:
        function = self.around(node)
        if function is not None:
            assigned = self._assigned(function, node)
            if assigned:
                return [
                    "".join(parts)
                    for parts in _products([self.texts(value, depth) for value in assigned if value is not node])
                ]
            parameters = [argument.arg for argument in function.args.args]
            if node.id in parameters:
                return self._given(function, parameters.index(node.id), node.id, depth)
        return self.texts(self.constants[node.id], depth) if node.id in self.constants else [GAP]

    def _assigned(self, function: ast.FunctionDef, name: ast.Name) -> list[ast.expr]:
        """The last assignment before the name is used, and what was added to it since."""
        found: list[ast.expr] = []
        statements = [n for n in ast.walk(function) if isinstance(n, (ast.Assign, ast.AugAssign))]
        for statement in sorted(statements, key=lambda n: n.lineno):
            target = statement.target if isinstance(statement, ast.AugAssign) else statement.targets[0]
            if not (isinstance(target, ast.Name) and target.id == name.id) or statement.lineno >= name.lineno:
                continue
            found = [*found, statement.value] if isinstance(statement, ast.AugAssign) else [statement.value]
        return found

    def _given(self, function: ast.FunctionDef, index: int, name: str, depth: int) -> list[str]:
        """What the calls of a function in this file give for a parameter."""
        calls = [n for n in ast.walk(self.tree) if isinstance(n, ast.Call) and name_of(n) == function.name]
        given = [c.args[index] for c in calls if len(c.args) > index]
        given += [word.value for c in calls for word in c.keywords if word.arg == name]
        return [text for value in given for text in self.texts(value, depth)] or [GAP]


def name_of(call: ast.Call) -> str:
    return call.func.id if isinstance(call.func, ast.Name) else getattr(call.func, "attr", "")


def all_messages() -> list[Message]:
    """Every message of both modules."""
    files = [path for folder in FOLDERS for path in sorted((ROOT / folder).rglob("*.py"))]
    trees = {path: ast.parse(path.read_text(encoding="utf-8")) for path in files}
    constants: dict[str, ast.expr] = {}
    for tree in trees.values():
        for node in tree.body:
            if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name) and node.targets[0].id.isupper():
                constants[node.targets[0].id] = node.value
    return [m for path, tree in trees.items() for m in messages_in(Source(path, tree, constants))]


def messages_in(source: Source) -> Iterator[Message]:
    for node in ast.walk(source.tree):
        if not isinstance(node, ast.Call):
            continue
        for word in node.keywords:
            if word.arg == "message":
                yield from _worded(source, word.value, "")
        taker = TAKERS.get(name_of(node), (None, 0) if _to_stderr(node) else None)
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


def _products(parts: list[list[str]]) -> list[list[str]]:
    found: list[list[str]] = [[]]
    for part in parts:
        found = [[*before, text] for before in found for text in part]
    return found
