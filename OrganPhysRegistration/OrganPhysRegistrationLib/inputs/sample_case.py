"""The sample case: a liver built from a formula and its splat, generated once and then read from the cache folder."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import slicer

import organphys
from organphys.ground.checks import InputError

from .organ_surface import organ_surface
from .splat_node import guess_scale, load_splat

NAME = "OrganPhys liver"
CATEGORY = "OrganPhys"
ORGAN = "liver"
FILES = ("ct_labels.nii.gz", "splat.ply", "landmarks.mrk.json", "case.json", "truth.npz")
THUMBNAIL = Path(__file__).parents[2] / "Resources" / "Icons" / "OrganPhysSampleCase.png"
COLOURS = {"liver": (0.72, 0.33, 0.28), "gallbladder": (0.35, 0.60, 0.30)}


@dataclass(frozen=True)
class SampleNodes:
    """segmentation and segment_id of the liver; splat model; landmarks (point list); folder of the files."""

    segmentation: Any
    segment_id: str
    splat: Any
    landmarks: Any
    folder: Path


def sample_folder() -> Path:
    """Where the sample case lies: in Slicer's cache folder."""
    cache = slicer.mrmlScene.GetCacheManager()
    root = cache.GetRemoteCacheDirectory() if cache is not None else ""
    return Path(root or slicer.app.temporaryPath) / f"OrganPhysSampleCase-{organphys.__version__}"


def load_sample_case(
    *, folder: str | Path | None = None, size: str = "full", on_status: Callable[[str], None] | None = None
) -> SampleNodes:
    """Load the sample case into the scene; it is made first if it is not there (a few seconds, no network).

    ``on_status``: called with one line before anything slow. InputError or OSError: the folder cannot be written.
    """
    folder = Path(folder) if folder is not None else sample_folder()
    tell = on_status or _show_status
    if not all((folder / name).is_file() for name in FILES):
        from organphys.pipeline.sample_case import write_sample_case

        tell("OrganPhys: the sample case is being made, this takes some seconds ...")
        write_sample_case(folder, size=size)
    tell("OrganPhys: the sample case is being loaded ...")
    facts = json.loads((folder / "case.json").read_text(encoding="utf-8"))
    splat = load_splat(folder / "splat.ply")
    splat.SetName("Sample splat")
    segmentation, segment_id = _segmentation(folder / "ct_labels.nii.gz", facts)
    guess_scale(splat, organ_surface(segmentation, segment_id))
    landmarks = _landmarks(folder / "landmarks.mrk.json")
    tell("")
    return SampleNodes(segmentation, segment_id, splat, landmarks, folder)


def register_sample_case(load: Callable[[], Any] = load_sample_case, *, thumbnail: str | Path = THUMBNAIL) -> None:
    """Offer the case in the Sample Data module; ``load``: called without arguments when the user chooses it."""
    import SampleData

    SampleData.SampleDataLogic.registerCustomSampleDataSource(
        category=CATEGORY,
        sampleName=NAME,
        thumbnailFileName=str(thumbnail),
        customDownloader=lambda source: _loaded_nodes(load),
    )


def _loaded_nodes(load: Callable[[], Any]) -> list[Any]:
    """Nodes of the case for the Sample Data module; what went wrong is shown, and nothing is loaded then."""
    from ..dependencies import DependencyError, ensure_packages

    try:
        ensure_packages()
        case = load()
    except (InputError, DependencyError, OSError) as error:
        slicer.util.errorDisplay(str(error))
        return []
    return [case.segmentation, case.splat, case.landmarks]


def _show_status(text: str) -> None:
    slicer.util.showStatusMessage(text)
    window = slicer.util.mainWindow()
    if window is not None:
        window.statusBar().repaint()  # before the work that holds up the event loop


def _segmentation(path: Path, facts: dict[str, Any]) -> tuple[Any, str]:
    """The label map as a segmentation node whose segments carry the names of case.json; and the liver's id."""
    segmentation = slicer.util.loadSegmentation(str(path), {"name": "Sample CT organs"})
    content, liver = segmentation.GetSegmentation(), ""
    for segment_id in list(content.GetSegmentIDs()):
        segment = content.GetSegment(segment_id)
        name = facts["label_names"].get(str(segment.GetLabelValue()), segment.GetName())
        segment.SetName(name)
        if name in COLOURS:
            segment.SetColor(*COLOURS[name])
        if name == ORGAN:
            liver = segment_id
    segmentation.CreateClosedSurfaceRepresentation()
    return segmentation, liver


def _landmarks(path: Path) -> Any:
    from organphys.readers.landmarks_file import read_landmarks

    landmarks = read_landmarks(path)
    node = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLMarkupsFiducialNode", "Sample landmarks")
    node.CreateDefaultDisplayNodes()
    for position, name in zip(landmarks.positions, landmarks.names, strict=True):
        node.AddControlPoint(position.tolist(), name)
    return node
