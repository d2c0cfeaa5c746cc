"""The case folders under a folder, checked before anything runs."""

from __future__ import annotations

from pathlib import Path

from organphys.ground.checks import InputError

FILES = ("case.json", "ct_labels.nii.gz", "splat.ply", "landmarks.mrk.json", "truth.npz")


def case_folders(folder: Path) -> dict[str, Path]:
    """{name: folder} of the cases in ``folder``, or of ``folder`` itself if it is one.

    InputError where there is none, or one lacks a file.
    """
    here = [folder] if (folder / "case.json").exists() else sorted(path.parent for path in folder.glob("*/case.json"))
    cases = {path.resolve().name: path.resolve() for path in here}
    if not cases:
        raise InputError(f"--cases: no case in {folder}; a case is a folder with {', '.join(FILES)}")
    for name, path in cases.items():
        lacking = [file for file in FILES if not (path / file).exists()]
        if lacking:
            raise InputError(f"--cases: {name} lacks {', '.join(lacking)}")
    return cases
