# SPDX-License-Identifier: Apache-2.0
"""The confidence in each mentor as a chart of ECharts, a line for each over the iterations."""

from collections.abc import Mapping
import time

from nicegui import ui

from comply_ros.dashboard.curve_panel import axis, chart_frame, line, PERIOD
from comply_ros.dashboard.dashboard_node import PageState
from comply_ros.plots.mentor_marks import mentor_color, NO_NAME
from comply_ros.protocol.iteration_curve import IterationCurve
from comply_ros.protocol.run_reports import RunReports

MOST_POINTS = 400  # of a line: there may be 16, and a chart has not many more pixels


class ConfidencePanel:
    """The chart; hidden while no confidence in any mentor is known."""

    def __init__(self) -> None:
        self._shown: dict[str, IterationCurve] = {}
        self._not_before = 0.0  # by the steady clock
        with ui.column().classes('panel').props('data-testid=confidence') as self._panel:
            self._title = ui.label().classes('panel-title')
            self._chart = ui.echart(confidence_options({}), renderer='svg').classes(
                'w-full chart').style('height: 180px')
        self._panel.visible = False

    def show(self, state: PageState) -> None:
        """Show a state of the page."""
        curves, now = confidence_curves(state.run.reports), time.monotonic()
        self._panel.visible = any(curve.is_known for curve in curves.values())
        if self._panel.visible and curves != self._shown and now >= self._not_before:
            self._shown, self._not_before = curves, now + PERIOD
            self._title.text = 'Confidence in ' + (
                'each mentor' if len(curves) > 1 else 'the mentor')
            self._chart.options.clear()
            self._chart.options.update(confidence_options(curves))
            self._chart.update()


def confidence_curves(reports: RunReports) -> dict[str, IterationCurve]:
    """Return the confidence in each mentor in each iteration, by the names on the page."""
    names = reports.mentor_names()
    unnamed = NO_NAME if len(names) > 1 else 'mentor'
    return {name or unnamed: reports.confidence_curve(name) for name in names}


def confidence_options(curves: Mapping[str, IterationCurve]) -> dict:
    """Options of a chart of the confidence in each mentor, in its color."""
    last = [curve.iterations[-1] for curve in curves.values() if curve.iterations]
    return {
        **chart_frame(list(curves)),
        'xAxis': axis('iteration', 1, max([*last, 10]), 'middle', 24, False),
        'yAxis': {**axis('', 0, 1, 'end', 0, True), 'minInterval': 0, 'interval': 0.25},
        'series': [line(name, points_of(curve), mentor_color(m), width=2,
                        symbols=curve.has_lone_points)
                   for m, (name, curve) in enumerate(curves.items())]}


def points_of(curve: IterationCurve) -> list[tuple[int, float | None]]:
    """Return the points of a curve, the newest and as many others as a chart shows."""
    every = -(-len(curve.iterations) // MOST_POINTS)
    points = list(zip(curve.iterations, curve.values))[::-1][::every or 1][::-1]
    return [(iteration, value if value == value else None) for iteration, value in points]
