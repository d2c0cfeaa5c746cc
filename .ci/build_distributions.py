"""Build sdist and wheel from a clean copy of the sources into a folder, the wheel out of the sdist."""

from __future__ import annotations

import shutil
import subprocess
import sys
import tarfile
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
NEEDED = (
    "pyproject.toml",
    "MANIFEST.in",
    "README.md",
    "LICENSE.txt",
    "THIRD_PARTY.md",
    "CHANGELOG.md",
    "constraints.txt",
)
PACKAGES = ("OrganPhysRegistration/organphys", "Testing/benchmarks/organphys_bench")


def build(out: Path) -> tuple[Path, Path]:
    """Paths of the sdist and the wheel below ``out``; the repository stays as it is."""
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "copy"
        copy.mkdir()
        for name in NEEDED:
            shutil.copy2(ROOT / name, copy / name)
        for name in PACKAGES:
            if (ROOT / name).is_dir():
                shutil.copytree(ROOT / name, copy / name, ignore=shutil.ignore_patterns("__pycache__", "*.egg-info"))
        sdist = out / _backend("build_sdist", copy, out)
        with tarfile.open(sdist) as archive:
            archive.extractall(folder, filter="data")
        unpacked = Path(folder) / sdist.name.removesuffix(".tar.gz")
        return sdist, out / _backend("build_wheel", unpacked, out)


def _backend(hook: str, source: Path, out: Path) -> str:
    """Name of the file that a hook of setuptools (PEP 517) writes into ``out``."""
    program = f"from setuptools import build_meta; print(build_meta.{hook}({str(out.absolute())!r}))"
    done = subprocess.run([sys.executable, "-c", program], cwd=source, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"{hook} failed:\n{done.stderr}")
    return done.stdout.splitlines()[-1]


if __name__ == "__main__":
    for path in build(Path(sys.argv[1])):
        print(path)
