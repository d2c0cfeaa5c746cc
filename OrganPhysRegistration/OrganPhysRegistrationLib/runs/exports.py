"""One case, one word for what to write, one path: the files of ``outputs`` by name."""

from __future__ import annotations

from pathlib import Path

from organphys.ground.checks import one_of

from ..outputs import case_exports, report_export
from ..outputs.case_record import CaseNodes

ENDINGS = {"surface": ".stl", "asset": ".organphys", "transform": ".h5", "report": ".html"}
REPORT = "report.html"


def export_case(case: CaseNodes, what: str, path: str | Path) -> str:
    """Write ``what`` of ENDINGS and return the file's path; a path without an ending gets that one.

    The report's path may be a folder. InputError: another word, another ending, not writable, no such result.
    """
    one_of(what, "what to export", tuple(ENDINGS))
    file = Path(path)
    if what == "report" and file.suffix != ENDINGS["report"]:
        file = file / REPORT
    file = file if file.suffix else file.with_suffix(ENDINGS[what])
    writers = {
        "surface": case_exports.export_surface,
        "asset": case_exports.export_asset,
        "transform": case_exports.export_transform,
        "report": report_export.export_report,
    }
    writers[what](case, file)
    return str(file)
