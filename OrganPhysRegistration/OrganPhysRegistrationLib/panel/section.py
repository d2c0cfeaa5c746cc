"""What every section of the panel has in common."""

from __future__ import annotations

import functools
import logging
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from slicer.i18n import tr as _
from slicer.util import VTKObservationMixin

from organphys.ground.checks import InputError

from ..dependencies import DependencyError
from ..runs.input_problems import sentence

if TYPE_CHECKING:
    from .panel import Panel


class Section(VTKObservationMixin):
    """Binds some widgets of the .ui to the logic. ``panel``: the shared state, see Panel."""

    def __init__(self, panel: Panel) -> None:
        VTKObservationMixin.__init__(self)
        self.panel = panel
        self.ui = panel.ui

    def bind(self) -> None:
        """The parameters are others now (or None, while a scene is being closed)."""

    def refresh(self) -> None:
        """Show the present state. Called after every change of a parameter; panel.parameters is not None."""

    def cleanup(self) -> None:
        """Give back what is observed."""
        self.removeObservers()


def guarded(method: Callable[..., Any]) -> Callable[..., None]:
    """A slot of a section: whatever goes wrong is told in the panel, in plain words, never in a dialog.

    The arguments of the signal beyond those the method takes are dropped.
    """
    taken = method.__code__.co_argcount - 1

    @functools.wraps(method)
    def run(self: Section, *args: Any) -> None:
        try:
            method(self, *args[:taken])
        except Exception as error:
            tell_failure(self.panel, method.__name__, error)

    return run


def tell_failure(panel: Panel, what: str, error: Exception) -> None:
    """An exception in plain words in the panel; one that is not about an input goes to the log as well."""
    if isinstance(error, (InputError, DependencyError)):
        panel.tell(sentence(str(error)), "error")
        return
    logging.error("OrganPhys: %s failed", what, exc_info=error)
    text = _("This did not work: {error}. The error log has the details.")
    panel.tell(text.format(error=str(error) or type(error).__name__), "error")
