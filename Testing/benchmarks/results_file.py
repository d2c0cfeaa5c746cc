"""RESULTS.md holds one part per benchmark: each writes its own and leaves the others."""

from __future__ import annotations

import datetime
import os
import platform
import re
from importlib.metadata import version
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


def machine_lines(command: str) -> list[str]:
    """What a part says about how it was made: command, date, machine and its load, versions."""
    info = Path("/proc/cpuinfo")
    names = re.findall(r"model name\s*: (.*)", info.read_text(encoding="utf-8")) if info.exists() else []
    load = f"{os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "not known"
    return [
        f"- command: `{command}`",
        f"- date: {datetime.date.today().isoformat()}",
        f"- machine: {names[0] if names else platform.processor()}, {os.cpu_count()} cores, load at the end {load}, "
        f"OMP_NUM_THREADS={os.environ.get('OMP_NUM_THREADS', 'not set')}",
        f"- versions: Python {platform.python_version()}, "
        + ", ".join(f"{name} {version(name)}" for name in ("organphys", "numpy", "scipy")),
    ]
