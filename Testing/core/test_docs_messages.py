"""messages.md lists every message of the code to the user, and none else; raised_messages.py counts those raised."""

from __future__ import annotations

import re
from collections import Counter

import pytest
from doc_pages import PAGES
from message_scan import Message, all_messages

PAGE = PAGES["messages.md"]


@pytest.fixture(scope="module")
def messages() -> list[Message]:
    return all_messages()


def table() -> list[list[str]]:
    rows = [line for line in PAGE.splitlines() if line.startswith("| ")]
    return [[cell.strip() for cell in line.strip().strip("|").split(" | ")] for line in rows[1:]]


def texts(cell: str) -> list[str]:
    return re.findall(r"`([^`]+)`", cell)


def test_every_message_stands_in_the_table(messages: list[Message]) -> None:
    told = {text for row in table() for text in texts(row[0])}
    missing = {m.text: m.place for m in messages if m.text not in told}
    rows = "\n".join(f"| `{text}` | cause | remedy |  <!-- {place} -->" for text, place in missing.items())
    assert not missing, f"write these rows into Resources/Docs/messages.md:\n{rows}"


def test_no_message_is_left_over(messages: list[Message]) -> None:
    told = Counter(text for row in table() for text in texts(row[0]))
    left = set(told) - {m.text for m in messages}
    assert not left, f"no code says this any more, take it out of messages.md: {sorted(left)}"
    assert max(told.values()) == 1, told.most_common(3)


def test_codes_are_those_of_the_code(messages: list[Message]) -> None:
    codes: dict[str, set[str]] = {}
    for message in messages:
        codes.setdefault(message.text, set()).update({message.code} - {""})
    for row in table():
        assert set(re.findall(r"\*\*(\w+)\*\*", row[0])) == set().union(*(codes[text] for text in texts(row[0]))), row


def test_every_row_has_cause_and_remedy() -> None:
    for row in table():
        assert len(row) == 3 and all(len(cell) > 8 and cell not in ("cause", "remedy") for cell in row), row


def test_the_scan_finds_texts_wherever_they_are_made(messages: list[Message]) -> None:
    found = {m.text: m.code for m in messages}
    assert found["…: this is a folder; name a file inside it"] == ""  # an f-string
    assert found["A registration is running: wait for it or press Cancel."] == ""  # a constant
    assert found["The splat has no opacity, so every point counts as fully opaque."] == "no_opacity"
    assert (
        found["Only … % of the organ's surface lies where the splat shows it."] == "barely_seen"
    )  # by way of a helper
    assert "landmarks: their midpoint is the organ's centroid, pick visible points" in found  # by a parameter
