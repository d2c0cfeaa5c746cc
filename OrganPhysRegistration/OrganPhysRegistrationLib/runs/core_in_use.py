"""Which copy of organphys Slicer has imported, and whether it is the one that belongs to this module."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from pathlib import Path

import organphys

from .child_program import MODULE_FOLDER


@dataclass(frozen=True)
class CoreInUse:
    """version and file of the imported package; own: it lies beside this module."""

    version: str
    file: str
    own: bool

    @property
    def warning(self) -> str | None:
        """What to do when another copy shadows the module's own, else None."""
        if self.own:
            return None
        return (
            f"Another copy of organphys ({self.version}, {self.file}) is used instead of the module's own: remove it "
            "with slicer.util.pip_uninstall('organphys') and restart Slicer."
        )


def core_in_use() -> CoreInUse:
    """The imported organphys."""
    file = Path(organphys.__file__).resolve()
    return CoreInUse(organphys.__version__, str(file), file.parents[1] == MODULE_FOLDER)


def log_core_in_use() -> CoreInUse:
    """Write to Slicer's log which organphys is in use; a warning when it is a stranger."""
    core = core_in_use()
    logging.info("OrganPhys: organphys %s, %s", core.version, core.file)
    if core.warning is not None:
        logging.warning("OrganPhys: %s", core.warning)
    return core
