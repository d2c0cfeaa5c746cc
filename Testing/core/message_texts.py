"""The texts that an expression of the code can give, found without running it; "…" stands for what is filled in.

A text made elsewhere is followed one step: a name to its assignment, a parameter to the calls of its function.
"""

from __future__ import annotations

import ast
import re
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

GAP = "…"


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


def _products(parts: list[list[str]]) -> list[list[str]]:
    found: list[list[str]] = [[]]
    for part in parts:
        found = [[*before, text] for before in found for text in part]
    return found
