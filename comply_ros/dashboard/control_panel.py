# SPDX-License-Identifier: Apache-2.0
"""Pause, step, speed and reset: buttons for what services and parameters do."""

from nicegui import ui

from comply_ros.dashboard.notifications import asked

SPEEDS = (0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0, 0.0)
FASTEST = 'as fast as it goes'


class ControlPanel:
    """Buttons, and the rate that is asked for beside the one that is measured."""

    def __init__(self, watcher):
        self._watcher, self._paused, self._rate = watcher, None, None
        with ui.column().classes('panel'):
            with ui.row().classes('w-full items-center gap-3'):
                ui.label('Control').classes('panel-title grow')
                self._measured = ui.label().classes('soft number').props('data-testid=rate')
            with ui.row().classes('w-full items-center gap-2'):
                self._pause = ui.button(icon='pause', on_click=self._hear_pause).props(
                    'data-testid=pause')
                self._step = ui.button('Step', icon='skip_next', on_click=self._hear_step).props(
                    'outline').props('data-testid=step')
                ui.element('div').classes('grow')
                ui.button('Reset', icon='restart_alt', on_click=self._ask_reset).props(
                    'outline color=negative').props('data-testid=reset')
            with ui.row().classes('w-full items-center gap-3 no-wrap'):
                self._speed = ui.slider(min=0, max=len(SPEEDS) - 1, step=1, value=0).props(
                    'dense aria-label=speed').classes('grow').props('data-testid=speed')
                self._speed.on('change', self._hear_speed)
                self._wanted = ui.label().classes('soft number').style(
                    'width: 9.5rem; white-space: nowrap').props(
                    'data-testid=speed-words')
        self._dialog = self._make_dialog()

    def renew(self, view):
        """Show a `View`."""
        if view.paused != self._paused:
            self._paused = view.paused
            self._pause.text = 'Resume' if view.paused else 'Pause'
            self._pause.props(f'icon={"play_arrow" if view.paused else "pause"}')
        self._step.set_enabled(view.paused)
        self._show_speed(view.settings.get('grid_world', {}).get('rate'))
        self._measured.text = rate_words(view)

    def _show_speed(self, setting):
        rate = setting and setting.value
        if rate != self._rate and rate is not None:
            self._rate = rate
            self._speed.value = nearest_speed(rate)
            self._wanted.text = speed_words(rate)

    async def _hear_pause(self):
        await asked(self._watcher.pause(not self._paused))

    async def _hear_step(self):
        await asked(self._watcher.step())

    async def _hear_speed(self):
        rate = SPEEDS[int(self._speed.value)]
        if not await asked(self._watcher.set('grid_world', 'rate', rate)):
            self._speed.value = nearest_speed(self._rate or 0.0)

    def _make_dialog(self):
        with ui.dialog() as dialog, ui.card():
            ui.label('Begin anew? The learner forgets all that it has learned; the mentor stays.')
            with ui.row().classes('w-full justify-end gap-2'):
                ui.button('Cancel', on_click=lambda: dialog.submit(False)).props('flat')
                ui.button('Reset', on_click=lambda: dialog.submit(True)).props(
                    'color=negative').props('data-testid=really')
        return dialog

    async def _ask_reset(self):
        if await self._dialog:
            await asked(self._watcher.reset())


def nearest_speed(rate):
    """Place on the slider of the speed that is nearest to a rate; 0.0 is at its end."""
    if not rate:
        return len(SPEEDS) - 1
    return min(range(len(SPEEDS) - 1), key=lambda i: abs(SPEEDS[i] - rate))


def speed_words(rate):
    """Words for a rate that is asked for."""
    return f'{rate:g} step{"" if rate == 1 else "s"} a second' if rate else FASTEST


def rate_words(view):
    """Words for the rate that the world measured."""
    if not view.lives('grid_world'):
        return ''
    return f'{view.health["grid_world"].values.get("steps per second", "?")} steps a second now'
