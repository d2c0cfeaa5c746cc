"""Files are whole or absent."""

from pathlib import Path

import numpy as np
import pytest

from organphys.ground.atomic_file import atomic_path, write_text
from organphys.ground.checks import InputError


def test_content_arrives_and_nothing_else_stays(tmp_path: Path) -> None:
    write_text(tmp_path / "deep" / "a.txt", "grün")
    assert (tmp_path / "deep" / "a.txt").read_text(encoding="utf-8") == "grün"
    assert [p.name for p in (tmp_path / "deep").iterdir()] == ["a.txt"]


@pytest.mark.parametrize("failure", [KeyboardInterrupt, RuntimeError])
def test_old_file_survives_a_failure(tmp_path: Path, failure: type[BaseException]) -> None:
    target = tmp_path / "a.txt"
    write_text(target, "old")
    with pytest.raises(failure), atomic_path(target) as temporary:
        temporary.write_text("half")
        raise failure
    assert target.read_text() == "old"
    assert len(list(tmp_path.iterdir())) == 1


def test_suffix_is_kept_so_that_numpy_adds_none(tmp_path: Path) -> None:
    with atomic_path(tmp_path / "q.npy") as temporary:
        np.save(temporary, np.arange(3))
    assert np.load(tmp_path / "q.npy").tolist() == [0, 1, 2]


def test_folder_that_cannot_be_made(tmp_path: Path) -> None:
    write_text(tmp_path / "file", "x")
    with pytest.raises(InputError, match="cannot be written"):
        write_text(tmp_path / "file" / "below.txt", "x")
    with pytest.raises(InputError, match="folder"):
        write_text(tmp_path, "x")
