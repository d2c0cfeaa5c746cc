"""Seed label maps: a corner of the sample's organs in every format and packing."""

from __future__ import annotations

import gzip
import tempfile
from pathlib import Path

import numpy as np
import SimpleITK as sitk
from mutate_volume import split_header

from organphys.pipeline.sample_case import SampleCase

SEGMENTS = {
    "Segment0_Name": "liver", "Segment0_LabelValue": "1", "Segment0_Layer": "0", "Segment0_ID": "Segment_1",
    "Segment1_Name": "vessel", "Segment1_LabelValue": "2", "Segment1_Layer": "0", "Segment1_Extent": "0 9 0 7 0 6",
}  # fmt: skip
VOXELS = "voxels.raw"
TABLE = b'<LabelTable><Label Key="1" Red="1">liver</Label><Label Key="2"><![CDATA[vessel]]></Label></LabelTable>'


def label_seeds(case: SampleCase) -> dict[str, bytes]:
    """Name -> content."""
    labels = sitk.GetArrayFromImage(sitk.ReadImage(str(case.labels)))
    k, j, i = (int(c) for c in np.argwhere(labels == 5).mean(axis=0))
    few = (labels[k - 18 : k + 18 : 5, j - 16 : j + 16 : 4, i - 20 : i + 20 : 4] == 5).astype(np.uint8)
    few[3:5, 3:6, 4:7] = 2
    out = {}
    with tempfile.TemporaryDirectory() as folder:
        for name, kind in (("octets", np.uint8), ("shorts", np.int16), ("floats", np.float32), ("wide", np.int64)):
            out |= _written(Path(folder), name, few.astype(kind))
        out |= _written(Path(folder), "named", few, SEGMENTS, formats=(".seg.nrrd",))
        layers = np.stack([few == 1, few == 2], axis=-1).astype(np.uint8)
        out |= _written(Path(folder), "layers", layers, _layered(), vector=True, formats=(".seg.nrrd", ".mha"))
    out |= detached(out["octets_raw.mha"], out["octets_raw.nrrd"])
    out["table.nii"] = with_table(gzip.decompress(out["octets.nii.gz"]), TABLE)
    out["table.nii.gz"] = gzip.compress(out["table.nii"], mtime=0)
    return out


def detached(mha: bytes, nrrd: bytes) -> dict[str, bytes]:
    """Headers alone, whose voxels are in the file of ``voxel_file``."""
    return {
        "detached.mhd": split_header(mha)[0].replace(b"LOCAL", VOXELS.encode()),
        "detached.nhdr": split_header(nrrd)[0].rstrip(b"\n") + f"\ndata file: {VOXELS}\n".encode(),
    }


def voxel_file() -> dict[str, bytes]:
    """The voxels of the detached headers."""
    return {VOXELS: np.tile(np.array([0, 1, 1, 2], dtype=np.uint8), 160).tobytes()}


def _layered() -> dict[str, str]:
    return SEGMENTS | {"Segment1_LabelValue": "1", "Segment1_Layer": "1"}


def _written(
    folder: Path,
    name: str,
    voxels: np.ndarray,
    metadata: dict[str, str] | None = None,
    *,
    vector: bool = False,
    formats: tuple[str, ...] = (".nii", ".nii.gz", ".nrrd", ".mha"),
) -> dict[str, bytes]:
    image = sitk.GetImageFromArray(voxels, isVector=vector)
    image.SetSpacing((1.5, 1.25, 2.0))
    image.SetOrigin((-10.0, 20.0, 30.0))
    for key, value in (metadata or {}).items():
        image.SetMetaData(key, value)
    out = {}
    for ending in formats:
        for packed in (False, True) if ending in (".nrrd", ".mha") else (True,):
            path = folder / f"{name}{'' if packed else '_raw'}{ending}"
            sitk.WriteImage(image, str(path), useCompression=packed)
            out[path.name] = path.read_bytes()
    return out


def with_table(content: bytes, table: bytes) -> bytes:
    """A .nii with a header extension."""
    size = -(-(len(table) + 8) // 16) * 16
    extension = size.to_bytes(4, "little") + (30).to_bytes(4, "little") + table.ljust(size - 8, b"\0")
    head = bytearray(content[:348])
    head[108:112] = np.float32(352 + size).tobytes()
    return bytes(head) + b"\x01\0\0\0" + extension + content[352:]
