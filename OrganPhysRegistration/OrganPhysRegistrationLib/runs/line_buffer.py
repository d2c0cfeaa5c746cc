"""Complete lines out of a byte stream that arrives in pieces."""

from __future__ import annotations

LONGEST_LINE = 1 << 20  # bytes; arrays travel in files, so that a line is short


class LineTooLong(Exception):
    """More than LONGEST_LINE bytes came without an end of line."""


class LineBuffer:
    """Keeps what is left of an unfinished line; a UTF-8 character may be cut between two pieces."""

    def __init__(self) -> None:
        self._rest = b""

    def feed(self, piece: bytes) -> list[str]:
        """Lines finished by ``piece``, without their ends and without empty ones; wrong UTF-8 is shown as such."""
        *lines, self._rest = (self._rest + piece).split(b"\n")
        if len(self._rest) > LONGEST_LINE or any(len(line) > LONGEST_LINE for line in lines):
            raise LineTooLong(f"a line of more than {LONGEST_LINE} bytes")
        texts = (line.decode("utf-8", errors="replace").strip() for line in lines)
        return [text for text in texts if text]
