"""Tables and plots of a case in the views: the layout gets a table or a plot view if it has none."""

from __future__ import annotations

from typing import Any

import slicer


def show_table(table: Any) -> None:
    """Show a table node."""
    manager = slicer.app.layoutManager()
    manager.setLayout(slicer.modules.tables.logic().GetLayoutWithTable(manager.layout))
    application = slicer.app.applicationLogic()
    application.GetSelectionNode().SetActiveTableID(table.GetID())
    application.PropagateTableSelection()


def show_chart(chart: Any) -> None:
    """Show a plot chart node."""
    manager = slicer.app.layoutManager()
    manager.setLayout(slicer.modules.plots.logic().GetLayoutWithPlot(manager.layout))
    application = slicer.app.applicationLogic()
    application.GetSelectionNode().SetActivePlotChartID(chart.GetID())
    application.PropagatePlotChartSelection()
