"""Every input that once made a reader fail, tried again.

python Testing/fuzz/replay.py FOLDER    one line of JSON for each file in found/: its name and what came of it
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

from reader_trial import tried
from seed_tables import named_files
from seed_volumes import voxel_file
from targets import TARGETS
from worker import confined

FOUND = Path(__file__).resolve().parent / "found"


def found_files() -> dict[str, str]:
    """Name of each file, READER_NUMBER_NAME, and what it did when it was found."""
    causes: dict[str, str] = json.loads((FOUND / "causes.json").read_text())
    return causes


def main(folder: Path) -> None:
    """Each twice, beside the files that some of them name: at the first call libraries load."""
    for name, content in (voxel_file() | named_files()).items():
        (folder / name).write_bytes(content)
    for round_ in range(2):
        for found in sorted(found_files()):
            reader, _, name = found.split("_", 2)
            content = (FOUND / found).read_bytes()
            (folder / name).write_bytes(content)
            outcome = tried(TARGETS[reader], folder / name, content)
            if round_:
                print(json.dumps([found, outcome.kind, outcome.what, outcome.detail]), flush=True)
        if not round_:
            confined()


if __name__ == "__main__":
    main(Path(sys.argv[1]))
