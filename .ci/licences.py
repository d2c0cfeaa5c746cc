"""THIRD_PARTY.md: the licence of every package that OrganPhys needs, read from what is installed (`make licences`).

What is not installed here keeps its line; for packages of other systems the licences below are told by hand.
"""

from __future__ import annotations

import re
import sys
from functools import cache
from importlib.metadata import PackageNotFoundError, distribution

from packaging.markers import default_environment
from requirements_closure import CORE, ROOT, closure, pins

TABLE = ROOT / "THIRD_PARTY.md"
NVIDIA = "NVIDIA's own terms, see the package"
BY_HAND = {  # of other systems or Pythons, or told in no metadata: from their repositories
    "atheris": "Apache-2.0",
    "colorama": "BSD-3-Clause",
    "exceptiongroup": "MIT",
    "pyobjc-core": "MIT",
    "pyobjc-framework-cocoa": "MIT",
    "six": "MIT",
    "tomli": "MIT",
    "triton": "MIT",
    "nvidia-nccl-cu13": "BSD-3-Clause",
    "cuda-pathfinder": "Apache-2.0",
}
ELSEWHERE = "another system, Python or build of torch"
CLASSIFIERS = {
    "Apache Software License": "Apache-2.0",
    "BSD License": "BSD",
    "MIT License": "MIT",
    "ISC License (ISCL)": "ISC",
    "Mozilla Public License 2.0 (MPL 2.0)": "MPL-2.0",
    "Python Software Foundation License": "PSF-2.0",
}
COPYLEFT = re.compile(r"GPL|MPL")
INTRODUCTION = """# Licences of what OrganPhys uses

OrganPhys itself is under the Apache License 2.0 (LICENSE.txt) and contains no code of these packages; `pip` brings
them. *Needed by*: `core` always, else the extra that asks for it. Marked with `*`: a copyleft licence. plyfile is under
the GPL: a distribution that includes it falls under the GPL. The CUDA build of torch brings NVIDIA's libraries under
NVIDIA's own terms; the CPU build (`--extra-index-url https://download.pytorch.org/whl/cpu`) brings none of them.

Written by `make licences` under Python 3.11 on Linux; a test keeps it in step with constraints.txt and with what is
installed.

| package | licence | needed by |
|---|---|---|
"""


@cache
def licence_of(name: str) -> str | None:
    """The licence that an installed package states; None where it is not installed."""
    try:
        about = distribution(name).metadata
    except PackageNotFoundError:
        return None
    if about.get("License-Expression"):
        return about.get("License-Expression")
    kinds = [c.split(" :: ")[-1] for c in about.get_all("Classifier", []) if c.startswith("License ::")]
    stated = [CLASSIFIERS.get(kind, kind) for kind in kinds if kind != "OSI Approved"]
    line = (about.get("License") or "").strip().splitlines()
    return ", ".join(dict.fromkeys(stated)) or (line[0][:60] if line else BY_HAND.get(name))


def written() -> dict[str, tuple[str, str]]:
    """Licence and *needed by* of each line of the table as it stands."""
    if not TABLE.exists():
        return {}
    lines = re.findall(r"^\| ([\w.-]+) \| (.+?)(?: \*)? \| (.+) \|$", TABLE.read_text(encoding="utf-8"), re.MULTILINE)
    return {name: (licence, groups) for name, licence, groups in lines if name != "package"}


def rows() -> dict[str, tuple[str, str]]:
    """Licence and *needed by* of every pinned package; exits with the names of those whose licence is not known."""
    before, needed, found, unknown = written(), closure({**default_environment()}), {}, []
    for name in sorted(pins()):
        own = NVIDIA if name.startswith(("nvidia-", "cuda-")) else None
        licence = licence_of(name) or BY_HAND.get(name) or own or before.get(name, (None,))[0]
        groups = needed_by(needed.get(name, set()))
        found[name] = (licence or "", groups or before.get(name, ("", ELSEWHERE))[1])
        unknown += [] if licence else [name]
    if unknown:
        sys.exit(f"licences: install these, or tell their licence in BY_HAND: {', '.join(unknown)}")
    return found


def needed_by(groups: set[str]) -> str:
    """``core`` says it all; the tests are named where nothing else needs the package."""
    others = groups - {"test", "slicer-test"}
    return CORE if CORE in groups else ", ".join(sorted(others or groups - {"slicer-test"} or groups))


def text() -> str:
    lines = [
        f"| {name} | {licence}{' *' if COPYLEFT.search(licence) else ''} | {groups} |"
        for name, (licence, groups) in rows().items()
    ]
    return INTRODUCTION + "\n".join(lines) + "\n"


if __name__ == "__main__":
    TABLE.write_text(text(), encoding="utf-8")
    print(f"{len(written())} packages in {TABLE.name}")
