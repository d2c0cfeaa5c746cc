"""RESULTS.md holds one part per benchmark: each writes its own and leaves the others."""

from __future__ import annotations

import re
from pathlib import Path


def write_part(path: Path, text: str) -> None:
    """Put ``text``, which begins with a line "# Title", in place of the part of that title, or at the end."""
    title = text.splitlines()[0]
    if not title.startswith("# "):
        raise ValueError(f"a part begins with '# Title', not with {title!r}")
    parts = re.split(r"(?m)^(?=# )", path.read_text(encoding="utf-8")) if path.exists() else []
    kept = [part.strip("\n") for part in parts if part.strip()]
    titles = [part.splitlines()[0] for part in kept]
    if title in titles:
        kept[titles.index(title)] = text.strip("\n")
    else:
        kept.append(text.strip("\n"))
    path.write_text("\n\n".join(kept) + "\n", encoding="utf-8")
