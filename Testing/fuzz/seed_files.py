"""The seed corpus: small sound files for every reader, from the generated sample case, as other programs write them,
and cut from real case files where there are any.

python Testing/fuzz/seed_files.py FOLDER    write them to FOLDER/READER/NAME
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "core")]

from seed_archives import archive_seeds  # noqa: E402
from seed_cases import case_seeds  # noqa: E402
from seed_programs import program_seeds  # noqa: E402
from seed_splats import splat_seeds  # noqa: E402
from seed_tables import named_files, table_seeds  # noqa: E402
from seed_texts import landmark_seeds, point_seeds, region_seeds, trajectory_seeds  # noqa: E402
from seed_volumes import label_seeds, voxel_file  # noqa: E402

from organphys.pipeline.sample_case import write_sample_case  # noqa: E402

CASES = HERE.parents[2] / "shared" / "cases" / "dev"


def seed_corpus(cases: Path | None = None) -> dict[str, dict[str, bytes]]:
    """Reader -> file name -> content; companions: files that others name; ``cases``: a folder of case folders."""
    corpus = _made()
    for more in (program_seeds(), {} if cases is None else case_seeds(cases)):
        for reader, files in more.items():
            corpus[reader] |= files
    corpus["pins"] |= {name: text for name, text in corpus["landmarks"].items() if name not in corpus["pins"]}
    return corpus


def _made() -> dict[str, dict[str, bytes]]:
    with tempfile.TemporaryDirectory() as folder:
        case = write_sample_case(folder, seed=0, size="small")
        landmarks = landmark_seeds(case)
        return {
            "companions": voxel_file() | named_files(),
            "splat": splat_seeds(case),
            "labels": label_seeds(case),
            "landmarks": landmarks,
            "pins": landmarks,
            "region": region_seeds(),
            "trajectory": trajectory_seeds(),
            "points": point_seeds(),
            **table_seeds(),
            **archive_seeds(),
        }


def write_corpus(folder: Path, cases: Path | None = None) -> None:
    """The corpus as files."""
    for reader, files in seed_corpus(cases).items():
        (folder / reader).mkdir(parents=True, exist_ok=True)
        for name, content in files.items():
            (folder / reader / name).write_bytes(content)


if __name__ == "__main__":
    write_corpus(Path(sys.argv[1]), CASES)
