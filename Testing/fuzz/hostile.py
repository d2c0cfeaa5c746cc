"""Values that break careless readers: numbers as text and as JSON, texts, names."""

from __future__ import annotations

from typing import Any

INTEGERS = (
    *("0", "-1", "1", "2", "3", "4", "7", "255", "256", "65535", "65536", "2147483647", "2147483648", "4294967295"),
    *("4294967296", "9223372036854775807", "18446744073709551616", "-2147483648", "1" + "0" * 40, "9" * 5000),
)
REALS = (
    *("nan", "-nan", "inf", "-inf", "Infinity", "1e308", "-1e308", "1e309", "1e-320", "1e39", "1e13", "-0.0", "1e-12"),
    *("0x10", "1_000", "0.5", "1e", ".", "--1", "\u0661\u0662", "\u00bd", "1,5", "1e9999999999"),
)
TEXTS = (
    *("", " ", "../../../../etc/passwd", "/etc/passwd", "/dev/zero", "LIST", "%s%n%x", "\x00", "a\x00b", "\x1b[31m"),
    *("caf\u00e9", "\u540d\u524d", "\u202etxt", "a" * 300, "a" * 70_000, "r=" + "1" * 50_000 + "x", "r= " * 2000),
    *("true", "None", "{}", "[]", "<!--", "'\"\\", "\u2028", "x\x85y", "$(id)", "CON", "r=0", "r=1e9"),
)
JSON_VALUES: tuple[Any, ...] = (
    *(None, True, False, 0, -1, 1, 2, 3, 255, 2**31, 2**63, 2**64, 10**30, -(10**300), 0.5, 1e308, -1e308, 1e-320),
    *(1e13, float("nan"), float("inf"), -float("inf"), "", "1", "nan", "\ud800", "\x00", [], {}, [[]], [None], {"": 0}),
    *([1, 2], [1, 2, 3], [1, 2, 3, 4], ["1", "2", "3"], [[1, 2, 3]], [True, True, True], [1e308] * 3, [0] * 3),
    *([float("nan")] * 3, [[1, 0, 0], [0, 1, 0], [0, 0, 1]], [0] * 4, [1, 0, 0, 0], list(range(1000)), {"array": "z"}),
    *({"record": "Body", "fields": {}}, {"tuple": [1, 2]}, {"tuple": 3}, "scene", "ct", "mm", "LPS", "RAS", "ROI"),
)
MEMBER_NAMES = (
    *("../../evil.npy", "/etc/passwd", "C:\\evil.npy", "z.npy", "a/b/c.npy", "\u540d.npy", "x" * 300 + ".npy"),
    *("", ".npy", "z.NPY", "organ.json", "basis/z.npy", "asset.npy", "a\nb.npy", "mask.npy", "splat/valid.npy"),
)
DTYPES = (
    "|O",
    "<c16",
    "|S8",
    "<U4",
    "<M8[s]",
    "<f2",
    ">f8",
    "<f4",
    "<f8",
    "<i8",
    "<i4",
    "|u1",
    "|b1",
    "|V8",
    "f8",
    "<f16",
)


def deep(opening: str, closing: str, depth: int) -> str:
    """Brackets nested to a depth."""
    return opening * depth + closing * depth
