"""The seed corpus: small sound files for every reader, made from the generated sample case.

python Testing/fuzz/seed_files.py FOLDER    write them to FOLDER/READER/NAME
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "core")]

from seed_archives import archive_seeds  # noqa: E402
from seed_splats import splat_seeds  # noqa: E402
from seed_texts import landmark_seeds, point_seeds, region_seeds, trajectory_seeds  # noqa: E402
from seed_volumes import label_seeds, voxel_file  # noqa: E402

from organphys.pipeline.sample_case import write_sample_case  # noqa: E402


def seed_corpus() -> dict[str, dict[str, bytes]]:
    """Reader -> file name -> content; companions: files that others name."""
    with tempfile.TemporaryDirectory() as folder:
        case = write_sample_case(folder, seed=0, size="small")
        landmarks = landmark_seeds(case)
        return {
            "companions": voxel_file(),
            "splat": splat_seeds(case),
            "labels": label_seeds(case),
            "landmarks": landmarks,
            "pins": landmarks,
            "region": region_seeds(),
            "trajectory": trajectory_seeds(),
            "points": point_seeds(),
            **archive_seeds(),
        }


def write_corpus(folder: Path) -> None:
    """The corpus as files."""
    for reader, files in seed_corpus().items():
        (folder / reader).mkdir(parents=True, exist_ok=True)
        for name, content in files.items():
            (folder / reader / name).write_bytes(content)


if __name__ == "__main__":
    write_corpus(Path(sys.argv[1]))
