# SPDX-License-Identifier: Apache-2.0
"""The learning curve, with the optimal and the mentor's level."""

import time

from nicegui import ui

from comply_ros.dashboard.curve_echart import curve_options
from comply_ros.dashboard.learning_curve import Curve

LEAST = 0.4  # seconds between two drawings: a chart is more work for a browser than a grid


class CurvePanel:
    """Chart, and its last point in words."""

    def __init__(self):
        self._shown, self._next = None, 0.0
        with ui.column().classes('panel'):
            ui.label('Learning').classes('panel-title')
            self._words = ui.label().classes('number').props('data-testid=progress')
            self._chart = ui.echart(curve_options(Curve(), None, None)).classes('w-full').style(
                'height: 230px')
            self._levels = ui.label().classes('soft number').props('data-testid=levels')

    def renew(self, view):
        """Show a `View`."""
        heard = view.sight.heard
        shown, now = (heard.curve, *view.levels), time.monotonic()
        self._words.text = progress_words(heard)
        self._levels.text = level_words(*view.levels)
        self._levels.visible = bool(self._levels.text)
        if shown != self._shown and now >= self._next:
            self._shown, self._next = shown, now + LEAST
            self._chart.options.clear()
            self._chart.options.update(curve_options(*shown))
            self._chart.update()


def progress_words(heard):
    """Sentence on the last iteration."""
    msg = heard.progress
    if msg is None:
        return 'No iteration has ended yet.'
    of = f' of {msg.iterations}' if msg.iterations else ''
    trust = '' if msg.confidence != msg.confidence else f', trust {msg.confidence:.2f}'
    return f'iteration {msg.iteration}{of}: mean return {msg.mean_return:.2f}{trust}'


def level_words(optimal, mentor):
    """Words on what the curve is measured against."""
    parts = [f'{what} earns {value:.2f} an episode' for what, value in (
        ('The best policy', optimal), ('the mentor alone', mentor)) if value is not None]
    return ', '.join(parts)
