"""A table that is written as HTML and as Markdown alike."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape

from organphys.readers.plain_numbers import is_number


@dataclass(frozen=True)
class Table:
    """title; columns; rows of texts, as many each; note: a sentence on how to read it; best: columns (numbers) whose
    smallest value is set in bold."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    note: str = ""
    best: frozenset[int] = frozenset()

    def __post_init__(self) -> None:
        if any(len(row) != len(self.columns) for row in self.rows):
            raise ValueError(f"table {self.title}: every row needs {len(self.columns)} cells")

    @property
    def html(self) -> str:
        head = "".join(f"<th>{escape(cell)}</th>" for cell in self.columns)
        bold = self._bold
        body = "".join(
            "<tr>" + "".join(_cell(cell, (i, k) in bold) for k, cell in enumerate(row)) + "</tr>"
            for i, row in enumerate(self.rows)
        )
        note = f"<p>{escape(self.note)}</p>" if self.note else ""
        table = f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
        return f"<h3>{escape(self.title)}</h3>{note}<div class='wide'>{table}</div>"

    @property
    def markdown(self) -> str:
        bold = self._bold
        lines = [self.columns, ("---",) * len(self.columns)]
        lines += [
            tuple(f"**{cell}**" if (i, k) in bold else cell for k, cell in enumerate(row))
            for i, row in enumerate(self.rows)
        ]
        table = "\n".join(f"| {' | '.join(line)} |" for line in lines)
        return "\n\n".join(filter(None, (f"## {self.title}", self.note, table)))

    @property
    def _bold(self) -> set[tuple[int, int]]:
        """Places of the smallest number of each column in ``best``."""
        found = set()
        for k in self.best:
            numbers = {i: float(row[k]) for i, row in enumerate(self.rows) if is_number(row[k])}
            found |= {(i, k) for i, number in numbers.items() if number == min(numbers.values())}
        return found


def _cell(text: str, bold: bool) -> str:
    return f"<td><b>{escape(text)}</b></td>" if bold else f"<td>{escape(text)}</td>"
