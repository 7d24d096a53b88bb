# SPDX-License-Identifier: Apache-2.0
"""The learner's parameters, which can be seen and changed while it runs."""

from typing import Any

from nicegui import ui

from comply_ros.dashboard.dashboard_node import DashboardNode, LEARNER_PARAMETERS, PageState
from comply_ros.dashboard.header_bar import succeeds
from comply_ros.dashboard.node_discovery import LEARNER
from comply_ros.dashboard.remote_parameters import RemoteParameter


class ParametersPanel:
    """An input for each parameter, made when the learner has reported its values."""

    def __init__(self, node: DashboardNode) -> None:
        self._node = node
        self._shown: dict[str, RemoteParameter] = {}
        self._inputs: dict[str, Any] = {}
        self._rows: list[tuple[ui.element, str]] = []  # with the text that a search looks in
        with ui.element('div').classes('panel'), ui.expansion("Learner's parameters").classes(
                'w-full').props('dense dense-toggle header-class="panel-title q-px-none" '
                                'data-testid=parameters'):
            self._search = ui.input(placeholder='search', on_change=self._on_search).props(
                'dense clearable').classes('w-full')
            self._list = ui.column().classes('w-full gap-3').style(
                'max-height: 360px; overflow-y: auto; flex-wrap: nowrap')

    def show(self, state: PageState) -> None:
        """Show a state of the page: an input changes where its value changed, by whomever."""
        parameters = state.parameters.get(LEARNER, {})
        if parameters is self._shown or not parameters:
            return
        if not self._inputs:
            with self._list:
                for name in filter(parameters.get, LEARNER_PARAMETERS):
                    self._make_input(name, parameters[name].value)
        for name, element in self._inputs.items():
            if name in parameters and parameters[name] != self._shown.get(name):
                element.value = parameters[name].value
                element.set_enabled(parameters[name].can_change)
        self._shown = parameters

    def _make_input(self, name: str, value: Any) -> None:
        text, choices = LEARNER_PARAMETERS[name]
        title, event = name.replace('_', ' '), 'update:model-value'
        with ui.element('div').classes('parameter') as row:
            with ui.column().classes('gap-0'):
                ui.label(title).classes('parameter-name')
                ui.label(text).classes('parameter-text')
            if isinstance(value, bool):
                element = ui.switch(value=value).props('dense')
            elif choices:
                element = ui.select(list(choices), value=value).props(
                    'dense outlined options-dense')
            else:
                element, event = ui.number(value=value).props('dense outlined'), 'change'
        element.props(f'data-testid=set-{name} aria-label="{name}"')
        element.on(event, lambda: self._on_change(name))
        self._inputs[name] = element
        self._rows.append((row, f'{title} {text}'.replace('_', ' ').lower()))

    async def _on_change(self, name: str) -> None:
        element, before = self._inputs[name], self._shown[name].value
        value = element.value
        if value is not None and isinstance(before, int | float) and not isinstance(before, bool):
            value = type(before)(value)
        if value is None or value == before or not await succeeds(
                self._node.set_remote_parameter(LEARNER, name, value)):
            element.value = before

    def _on_search(self) -> None:
        wanted = (self._search.value or '').replace('_', ' ').lower()
        for row, text in self._rows:
            row.set_visibility(wanted in text)
