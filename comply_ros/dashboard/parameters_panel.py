# SPDX-License-Identifier: Apache-2.0
"""The learner's parameters, to be seen and changed while it runs."""

from nicegui import ui

from comply_ros.dashboard.notifications import asked
from comply_ros.learner.learner_config import CONFIG_FIELDS
from comply_ros.nodes.parameters import ADVICE_TIMEOUT, REMEMBERS_ADVICE


def described():
    """Yield (name, meaning, choices) of each parameter."""
    for name, field in CONFIG_FIELDS.items():
        yield name, field.metadata['text'], field.metadata.get('choices')
    for parameter in (REMEMBERS_ADVICE, ADVICE_TIMEOUT):
        yield parameter.name, parameter.description, None


class SettingsPanel:
    """An input for each parameter, made when the learner has told its values."""

    def __init__(self, watcher):
        self._watcher, self._shown, self._inputs = watcher, {}, {}
        with ui.element('div').classes('panel'), ui.expansion(
                "Learner's parameters").classes('w-full').props(
                'dense dense-toggle header-class="panel-title q-px-none" data-testid=settings'):
            self._search = ui.input(placeholder='search', on_change=self._filter).props(
                'dense clearable').classes('w-full')
            self._place = ui.column().classes('w-full gap-3').style(
                'max-height: 360px; overflow-y: auto; flex-wrap: nowrap')

    def renew(self, view):
        """Show a `View`: where a value has changed, by whomever, its input shows it."""
        settings = view.settings.get('learner', {})
        if settings is self._shown or not settings:
            return
        if not self._inputs:
            self._make_inputs(settings)
        for name, (element, _) in self._inputs.items():
            if name in settings and settings[name] != self._shown.get(name):
                element.value = settings[name].value
                element.set_enabled(settings[name].changes)
        self._shown = settings

    def _make_inputs(self, settings):
        with self._place:
            for name, text, choices in described():
                if name in settings:
                    self._make_input(name, text, choices, settings[name].value)

    def _make_input(self, name, text, choices, value):
        with ui.element('div').classes('setting') as row:
            with ui.column().classes('gap-0'):
                ui.label(name.replace('_', ' ')).classes('setting-name')
                ui.label(text).classes('setting-text')
            element = self._element(value, choices)
        element.props(f'data-testid=set-{name}').props(f'aria-label="{name}"')
        self._inputs[name] = element, (row, f'{name} {text}'.replace('_', ' ').lower())
        event = 'update:model-value' if choices or isinstance(value, bool) else 'change'
        element.on(event, lambda: self._set(name))

    @staticmethod
    def _element(value, choices):
        if isinstance(value, bool):
            return ui.switch(value=value).props('dense')
        if choices:
            return ui.select(list(choices), value=value).props('dense outlined options-dense')
        return ui.number(value=value).props('dense outlined')

    async def _set(self, name):
        element, before = self._inputs[name][0], self._shown[name].value
        value = element.value
        if value is not None and isinstance(before, int | float) and not isinstance(before, bool):
            value = type(before)(value)
        if value is None or value == before:
            element.value = before
        elif not await asked(self._watcher.set('learner', name, value)):
            element.value = before

    def _filter(self):
        wanted = (self._search.value or '').replace('_', ' ').lower()
        for _, (row, text) in self._inputs.values():
            row.set_visibility(wanted in text)
