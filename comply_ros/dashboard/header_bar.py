# SPDX-License-Identifier: Apache-2.0
"""The top of the page: which lesson this is, and what stops it, if anything does."""

from nicegui import ui

from comply_ros.dashboard.dashboard_node import EXPECTED, SILENT

COLOURS = {'runs': 'positive', 'paused': 'warning', 'stands still': 'negative'}
START = {'grid_world': 'scripts/run grid_world', 'mentor': 'scripts/run mentor',
         'learner': 'scripts/run learner'}


class HeaderBar:
    """Title, state of the lesson, and an alarm that says who is missing."""

    def __init__(self):
        with ui.row().classes('w-full items-center gap-3 no-wrap'):
            ui.label('comply_ros').classes('text-lg font-semibold')
            self._world = ui.label().classes('soft grow ellipsis')
            self._state = ui.badge().props('outline').classes('number').props('data-testid=state')
            self._dark = ui.dark_mode(None)
            with ui.button(icon='contrast', on_click=self._next_dark).props(
                    'flat round dense color=grey aria-label="light or dark"'):
                ui.tooltip('light or dark')
        self._alarm = ui.label().classes('alarm').props('role=alert').props('data-testid=alarm')

    def renew(self, view):
        """Show a `View`."""
        described = view.sight.described
        self._world.text = '' if described is None else (
            f'{described.name}, {described.width} x {described.height}, run {described.run}')
        words = state_words(view)
        self._state.text = words
        self._state.props(f'color={COLOURS.get(words, "grey")}')
        self._alarm.text = alarm(view)
        self._alarm.visible = bool(self._alarm.text)

    def _next_dark(self):
        self._dark.value = not self._dark.value


def state_words(view):
    """One word or two for what the lesson does."""
    if view.sight.described is None:
        return 'no world yet'
    if not all(view.lives(name) for name in ('grid_world', 'learner')):
        return 'stands still'
    if view.paused:
        return 'paused'
    progress = view.sight.heard.progress
    return 'has finished' if progress and progress.finished else 'runs'


def alarm(view):
    """Sentences on who is lost or missing; '' while nobody is."""
    return ' '.join(sentence for sentence in (_missing(view, name) for name in EXPECTED)
                    if sentence)


def _missing(view, name):
    if view.lives(name):
        return ''
    silent = view.silent(name)
    if silent is None and view.at - view.began < SILENT:
        return ''  # it speaks once a second, and may not have had its turn yet
    since = 'is not heard' if silent is None else f'has been silent for {silent:.0f} s'
    return f'The {name} {since}: start it with {START[name]}.'
