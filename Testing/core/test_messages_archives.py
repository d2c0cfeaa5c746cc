"""Messages about assets, sequences and cases whose numbers cannot be, as far as no other test raises them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from asset_examples import bent_organ

from organphys.asset.array_archive import archive_bytes, read_archive
from organphys.asset.asset_file import asset_bytes, asset_from_bytes
from organphys.asset.organ_sequence import OrganSequence
from organphys.asset.registered_organ import RegisteredOrgan
from organphys.asset.sequence_file import load_sequence, save_sequence
from organphys.ground.checks import InputError
from organphys.pipeline.case_file import CASE, HEADER, load_case, save_case
from organphys.points.point_sets import GaussianCloud


@pytest.fixture(scope="module")
def organ() -> RegisteredOrgan:
    return bent_organ()


def cloud() -> GaussianCloud:
    centres = np.random.default_rng(0).normal(size=(500, 3))
    return GaussianCloud(centres, np.ones(500), np.ones((500, 3)), np.ones(500, dtype=bool))


HEADERS: dict[str, dict[str, Any]] = {
    "a length, scale": {"volume_ml": -1.0},
    "a rotation that is none": {"T_scene_ct": {"scale": 1.0, "rotation": [[1, 0, 0]] * 3, "translation": [0, 0, 0]}},
}


@pytest.mark.parametrize("words", HEADERS)
def test_assets_with_impossible_numbers(words: str, organ: RegisteredOrgan, tmp_path: Path) -> None:
    (tmp_path / "whole").write_bytes(asset_bytes(organ))
    header, arrays = read_archive(tmp_path / "whole", "organ.json")
    with pytest.raises(InputError, match=rf"damaged.*{words}"):
        asset_from_bytes(archive_bytes("organ.json", header | HEADERS[words], arrays))


def test_sequence_with_a_notice_of_no_frame(organ: RegisteredOrgan, tmp_path: Path) -> None:
    T = organ.T_scene_ct
    whole = OrganSequence(
        organ, np.zeros(1), organ.z[None], np.array([T.scale]), T.rotation[None], T.translation[None], ("first",)
    )
    save_sequence(whole, tmp_path / "whole")
    header, arrays = read_archive(tmp_path / "whole", "sequence.json")
    (tmp_path / "odd").write_bytes(archive_bytes("sequence.json", header | {"notices": [[7, "lost"]]}, arrays))
    with pytest.raises(InputError, match="a notice of a frame that is not there"):
        load_sequence(tmp_path / "odd")


CASES: dict[str, tuple[str, Any]] = {
    "do not fit together; write the case again": ("splat/opacities", np.ones(3)),
    "holds numbers that no splat has": ("splat/opacities", np.full(500, 7.0)),
    r"damaged \('mask'\); write the case again": ("mask", None),
}


@pytest.mark.parametrize("words", CASES)
def test_cases_of_another_process(words: str, tmp_path: Path) -> None:
    save_case(tmp_path, mask=np.ones((4, 4, 4), dtype=bool), ijk_to_ras=np.eye(4), splat=cloud())
    header, arrays = read_archive(tmp_path / CASE, HEADER)
    name, value = CASES[words]
    changed = {key: array for key, array in (arrays | {name: value}).items() if array is not None}
    (tmp_path / CASE).write_bytes(archive_bytes(HEADER, header, changed, sort_keys=False))
    with pytest.raises(InputError, match=words):
        load_case(tmp_path / CASE)


def test_newer_sequence(tmp_path: Path) -> None:
    path = tmp_path / "organ.organphys-seq"
    path.write_bytes(archive_bytes("sequence.json", {"format": "organphys-sequence", "version": 99}, {}))
    with pytest.raises(InputError, match="sequence version 99 is newer than 1; update organphys"):
        load_sequence(path)
