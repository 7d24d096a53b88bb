# SPDX-License-Identifier: Apache-2.0
"""The status of each node, as it publishes it on /diagnostics."""

from collections import Counter

from nicegui import ui

from comply_ros.dashboard.dashboard_node import PageState
from comply_ros.dashboard.node_discovery import missing_text
from comply_ros.nodes.diagnostics import OK, WARN

DOTS = {OK: 'well', WARN: 'waiting'}  # CSS class by level; every other level is 'ill'


class HealthPanel:
    """A coloured dot and a line of text for each node."""

    def __init__(self) -> None:
        self._rows: dict[str, tuple[ui.element, ui.element, ui.label]] = {}
        with ui.column().classes('panel') as self._panel:
            ui.label('Nodes').classes('panel-title')

    def show(self, state: PageState) -> None:
        """Show a state of the page."""
        shown = dict.fromkeys((*(each.name for each in state.roles.values()), *state.nodes))
        for name in [each for each in self._rows if each not in shown]:
            row, *_ = self._rows.pop(name)
            row.delete()
        for name in shown:
            if name not in self._rows:
                with self._panel, ui.element('div').classes('node') as row:
                    dot = ui.element('div').classes('dot')
                    ui.label(name)
                    self._rows[name] = row, dot, ui.label().classes('words').props(
                        f'data-testid=health-{name}')
            _, dot, label = self._rows[name]
            label.text, kind = health_text(state, name)
            dot.classes(replace=f'dot {kind}')


def health_text(state: PageState, name: str) -> tuple[str, str]:
    """Text on a node, and the CSS class of its dot: '' for a node that never sent a status."""
    if name not in state.nodes:
        role, node = next(each for each in state.roles.items() if each[1].name == name)
        return (f'publishes on {node.topic}, and has sent no status' if node.is_publishing
                else missing_text(role, node)), ''
    if not state.is_alive(name):
        return f'lost: no status for {state.silence(name):.0f} s', 'ill'
    status, counts = state.nodes[name], Counter()
    for key, value in status.values.items():
        kind, colon, _ = key.partition(': ')  # messages are counted by what happened to them
        if colon and value.isdigit():
            counts[kind] += int(value)
    parts = [status.message, *(f'{kind} {count}' for kind, count in counts.items() if count)]
    return ', '.join(parts), DOTS.get(status.level, 'ill')
