# SPDX-License-Identifier: Apache-2.0
"""The learning curve as a chart of ECharts, with the returns that it is compared with."""

import time
from typing import Any

from nicegui import ui
import numpy as np

from comply_ros.dashboard.dashboard_node import PageState
from comply_ros.plots.running_mean import running_mean
from comply_ros.protocol.iteration_curve import IterationCurve
from comply_ros.protocol.run_reports import RunReports

PERIOD = 0.4  # least seconds between two drawings: a chart is more work for a browser than a grid
# On light and on dark.
BLUE, GREEN, ORANGE, GREY, PALE = '#2b8fd6', '#009E73', '#E69F00', '#8a919c', '#8a919c66'


class CurvePanel:
    """The chart, and its last point in words."""

    def __init__(self) -> None:
        self._shown: tuple = ()
        self._not_before = 0.0  # by the steady clock
        with ui.column().classes('panel'):
            ui.label('Learning').classes('panel-title')
            self._progress = ui.label().classes('number').props('data-testid=progress')
            self._chart = ui.echart(chart_options(IterationCurve(), None, None),
                                    renderer='svg').classes('w-full chart').style('height: 230px')
            self._references = ui.label().classes('soft number').props(
                'data-testid=reference-returns')

    def show(self, state: PageState) -> None:
        """Show a state of the page."""
        reports, now = state.run.reports, time.monotonic()
        self._progress.text = progress_text(reports)
        self._references.text = reference_text(*state.reference_returns)
        self._references.visible = bool(self._references.text)
        shown = (reports.curve, *state.reference_returns)
        if shown != self._shown and now >= self._not_before:
            self._shown, self._not_before = shown, now + PERIOD
            self._chart.options.clear()
            self._chart.options.update(chart_options(*shown))
            self._chart.update()


def progress_text(reports: RunReports) -> str:
    """Sentence on the last iteration."""
    msg = reports.progress
    if msg is None:
        return 'No iteration has ended yet.'
    of_all = f' of {msg.iterations}' if msg.iterations else ''
    trust = '' if msg.confidence != msg.confidence else f', trust {msg.confidence:.2f}'
    return f'iteration {msg.iteration}{of_all}: mean return {msg.mean_return:.2f}{trust}'


def reference_text(optimal: float | None, mentor: float | None) -> str:
    """Text of the expected returns that the curve is compared with, '' where none is known."""
    known = [f'{name} {value:.2f}' for name, value in (
        ('optimal policy', optimal), ('mentor alone', mentor)) if value is not None]
    return 'expected return: ' + ', '.join(known) if known else ''


def chart_options(curve: IterationCurve, optimal: float | None, mentor: float | None) -> dict:
    """Options of a chart of the curve, with a line for each expected return that is known."""
    x, y = list(curve.iterations), list(curve.values)
    alone = len(x) == 1  # a line of one point cannot be seen
    references = [(f'{name} {value:.2f}', value, colour, dash) for name, value, colour, dash in (
        ('optimal', optimal, GREEN, 'solid'), ('mentor', mentor, ORANGE, 'dashed'))
        if value is not None]
    end = max(x[-1] if x else 0, 10)
    low, high = bounds(y, [value for _, value, *_ in references])
    return {
        **chart_frame(['learner', *(name for name, *_ in references)]),
        'xAxis': axis('iteration', 1, end, 'middle', 24, False),
        'yAxis': without_ends(axis('', low, high, 'end', 0, True)),
        'series': [
            line('each', zip(x, y), BLUE, width=1, opacity=0.5),
            line('learner', zip(x, running_mean(y).tolist()), BLUE, width=2.5, symbols=alone),
            *(line(name, [(1, value), (end, value)], colour, dash=dash, z=1)
              for name, value, colour, dash in references)]}


def chart_frame(names: list[str]) -> dict:
    """Options of a chart besides its axes and lines: the legend with these names, the tooltip."""
    return {
        'animation': False, 'textStyle': {'fontFamily': 'Roboto, sans-serif'},
        'grid': {'left': 46, 'right': 12, 'top': 30, 'bottom': 36},
        'legend': {'top': 0, 'left': 8, 'icon': 'roundRect', 'itemWidth': 16, 'itemHeight': 4,
                   'type': 'scroll', 'pageIconColor': GREY, 'pageIconInactiveColor': PALE,
                   'pageTextStyle': {'color': GREY},
                   'textStyle': {'color': GREY}, 'selectedMode': False, 'data': names},
        'tooltip': {'trigger': 'axis', ':valueFormatter':
                    "(value) => value == null ? '-' : value.toFixed(2)"}}


def bounds(returns: list[float], references: list[float]) -> tuple[float, float]:
    """
    Return (low, high) of the axis of the returns.

    The first iterations, and a mentor that never arrives, can earn so little that all else would
    look flat: what is further below the learned returns than twice their span is cut off, but not
    the newest return.
    """
    high = max([*returns, *references], default=1.0)
    worst = max(len(returns) // 20, int(len(returns) >= 5))
    low = min(sorted(returns)[worst:] or references or [0.0])
    low = min([low, *(each for each in references if each >= low - 2 * (high - low))])
    low = min([low, *returns[-1:]])
    margin = 0.06 * (high - low) or 1.0
    return float(np.floor(low - margin)), float(np.ceil(high + margin))


def without_ends(options: dict) -> dict:
    """Return an axis without the labels of its ends, which would lie on those beside them."""
    is_long = options['max'] - options['min'] > 4  # else there may be no others
    return options | {'axisLabel': options['axisLabel'] | {
        'showMinLabel': not is_long, 'showMaxLabel': not is_long}}


def axis(name: str, low: float, high: float, location: str, gap: int, grid_lines: bool) -> dict:
    """Options of an axis from `low` to `high`."""
    return {'type': 'value', 'minInterval': 1, 'min': low, 'max': high,
            'name': name, 'nameLocation': location, 'nameGap': gap,
            'nameTextStyle': {'color': GREY},
            'axisLabel': {'color': GREY, 'hideOverlap': True},
            'axisLine': {'show': not grid_lines, 'onZero': False, 'lineStyle': {'color': GREY}},
            'splitLine': {'show': grid_lines, 'lineStyle': {'color': GREY, 'opacity': 0.2}}}


def line(name: str, points: Any, colour: str, width: float = 1.5, opacity: float = 1.0,
         dash: str = 'solid', z: int = 2, symbols: bool = False) -> dict:
    """Options of a line through points (x, y); it has a gap where y is None."""
    return {'type': 'line', 'name': name, 'data': [list(point) for point in points], 'z': z,
            'showSymbol': symbols, 'symbolSize': 8, 'clip': True, 'itemStyle': {'color': colour},
            'lineStyle': {'color': colour, 'width': width, 'opacity': opacity, 'type': dash}}
