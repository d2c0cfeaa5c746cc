"""Ways from the panel to the segmentation extensions that are installed."""

from __future__ import annotations

from typing import Any

import qt
import slicer
from slicer.i18n import tr as _

MODULES = {"TotalSegmentator": "TotalSegmentator", "MONAIAuto3DSeg": "MONAI Auto3DSeg"}


def installed() -> list[str]:
    """Names of the automatic segmentation modules that this Slicer has."""
    return [name for name in MODULES if hasattr(slicer.modules, name.lower())]


def offer(button: Any) -> None:
    """Give the tool button a menu of what is there; hide it where nothing is."""
    names = installed()
    menu = qt.QMenu(button)
    for name in names:
        action = menu.addAction(_("Segment with {module}").format(module=MODULES[name]))
        action.connect("triggered()", lambda name=name: slicer.util.selectModule(name))
    button.setMenu(menu)
    button.visible = bool(names)
