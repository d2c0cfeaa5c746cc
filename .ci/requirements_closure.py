"""Which packages OrganPhys needs, directly and in turn, for which of its extras: from what is installed."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable, Mapping
from functools import cache
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import Any

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

try:
    import tomllib
except ModuleNotFoundError:  # Python 3.10, where pytest brings its forerunner
    import tomli as tomllib

ROOT = Path(__file__).resolve().parents[1]
CORE = "core"
LOCKED = "# What these need in turn, for every Python from 3.10; written by `make lock`."


def direct_requirements() -> dict[str, list[Requirement]]:
    """Requirements of the core and of each extra, as pyproject.toml states them."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    groups = {CORE: project["dependencies"], **project["optional-dependencies"]}
    return {name: [Requirement(line) for line in lines] for name, lines in groups.items()}


def closure(environment: Mapping[str, str]) -> dict[str, set[str]]:
    """Extras (or CORE) that need each package, by canonical name, where markers are true in ``environment``."""
    groups, needed = direct_requirements(), defaultdict[str, set[str]](set)
    for group in groups:
        _walk(groups[group], group, environment, groups, needed)
    return dict(needed)


def _walk(
    requirements: Iterable[Requirement],
    group: str,
    environment: Mapping[str, str],
    groups: Mapping[str, list[Requirement]],
    needed: dict[str, set[str]],
) -> None:
    for requirement in requirements:
        if requirement.marker is not None and not requirement.marker.evaluate({"extra": "", **environment}):
            continue
        name = canonicalize_name(requirement.name)
        if name == "organphys":
            for extra in requirement.extras:
                _walk(groups[extra], group, environment, groups, needed)
        elif group not in needed[name]:
            needed[name].add(group)
            _walk(_requirements_of(name, requirement.extras, environment), group, environment, groups, needed)


def _requirements_of(name: str, extras: Iterable[str], environment: Mapping[str, str]) -> list[Requirement]:
    """What an installed package needs with ``extras``; nothing is known of one that is not installed."""
    wanted = ["", *extras]
    found = _stated_by(name)
    return [r for r in found if r.marker is None or any(r.marker.evaluate({**environment, "extra": e}) for e in wanted)]


@cache
def _stated_by(name: str) -> tuple[Requirement, ...]:
    try:
        return tuple(Requirement(line) for line in distribution(name).requires or ())
    except PackageNotFoundError:
        return ()


@cache
def pins() -> dict[str, list[Requirement]]:
    """All pins of constraints.txt by canonical name."""
    found = defaultdict[str, list[Requirement]](list)
    for line in (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines():
        text = re.sub(r"(^|\s)#.*", "", line).strip()
        if text:
            found[canonicalize_name(Requirement(text).name)].append(Requirement(text))
    return dict(found)


def linux(version: str) -> dict[str, Any]:
    """The marker environment of a Python on 64-bit Linux."""
    return {
        "python_version": version,
        "python_full_version": f"{version}.9",
        "implementation_version": f"{version}.9",
        "sys_platform": "linux",
        "platform_system": "Linux",
        "platform_machine": "x86_64",
        "os_name": "posix",
        "platform_python_implementation": "CPython",
        "implementation_name": "cpython",
    }
