"""Pin what the pinned packages need in turn: writes the lower part of constraints.txt. Needs uv (`make lock`).

One resolution holds for all Pythons from 3.10 and all systems. What is installed here, and so was tested, is kept to
where it can be; to move on to newer versions, install them first.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from importlib.metadata import distributions
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from requirements_closure import LOCKED, ROOT


def main() -> None:
    constraints = ROOT / "constraints.txt"
    ours = constraints.read_text(encoding="utf-8").split(LOCKED)[0].rstrip() + "\n"
    named = {canonicalize_name(Requirement(line).name) for line in ours.splitlines() if line and line[0] != "#"}
    found = [line for line in resolved(ours) if canonicalize_name(Requirement(line).name) not in named]
    constraints.write_text("\n".join([ours.rstrip(), LOCKED, *found]) + "\n", encoding="utf-8")
    print(f"{len(named)} packages pinned by hand, {len(found)} lines for what they need")


def installed() -> str:
    """What is installed here, as pins; a local version such as +cpu is of one machine only."""
    found = {canonicalize_name(one.metadata["Name"]): one.version.split("+")[0] for one in distributions()}
    return "".join(f"{name}=={version}\n" for name, version in sorted(found.items()) if name != "organphys")


def resolved(ours: str) -> list[str]:
    """All pins that uv finds under our own."""
    with tempfile.TemporaryDirectory() as folder:
        limits, out = Path(folder) / "ours.txt", Path(folder) / "out.txt"
        limits.write_text(ours, encoding="utf-8")
        out.write_text(installed(), encoding="utf-8")
        command = ["uv", "pip", "compile", "--quiet", "--universal", "--all-extras", "--no-header", "--no-annotate"]
        more = ["--no-build", "--python-version", "3.10", "-c", str(limits), "-o", str(out)]
        done = subprocess.run([*command, *more, "pyproject.toml"], cwd=ROOT, stdout=subprocess.DEVNULL, check=False)
        if done.returncode:
            sys.exit("lock: no set of versions fits; see above")
        return [line for line in out.read_text(encoding="utf-8").splitlines() if line and not line.startswith("#")]


if __name__ == "__main__":
    main()
