# SPDX-License-Identifier: Apache-2.0
"""How each node is, in the words that it says on /diagnostics."""

from nicegui import ui

from comply_ros.dashboard.dashboard_node import EXPECTED
from comply_ros.nodes.diagnostics import ERROR, OK, WARN


class HealthPanel:
    """A line for each node."""

    def __init__(self):
        self._rows = {}
        with ui.column().classes('panel') as self._panel:
            ui.label('Nodes').classes('panel-title')

    def renew(self, view):
        """Show a `View`."""
        for name in dict.fromkeys((*EXPECTED, *view.health)):
            if name not in self._rows:
                self._rows[name] = self._make_row(name)
            dot, words = self._rows[name]
            words.text, kind = health_words(view, name)
            dot.classes(replace=f'dot {kind}')

    def _make_row(self, name):
        with self._panel, ui.element('div').classes('node'):
            dot = ui.element('div').classes('dot')
            ui.label(name)
            return dot, ui.label().classes('words').props(f'data-testid=health-{name}')


def health_words(view, name):
    """Words on a node, and its kind: well, waiting, ill, or '' for one that was never heard."""
    if name not in view.health:
        return 'is not heard', ''
    if not view.lives(name):
        return f'is lost: silent for {view.silent(name):.0f} s', 'ill'
    status = view.health[name]
    kinds = {_number(OK): 'well', _number(WARN): 'waiting', _number(ERROR): 'ill'}
    return ', '.join([status.words, *counts(status.values)]), kinds.get(status.level, 'ill')


def counts(values):
    """Yield words on what a node has rejected and ignored."""
    for what in ('rejected', 'ignored'):
        number = sum(int(value) for key, value in values.items()
                     if key.startswith(f'{what}: ') and value.isdigit())
        if number:
            yield f'{what} {number}'


def _number(level):
    return level[0] if isinstance(level, bytes) else level
