# SPDX-License-Identifier: Apache-2.0
"""The buttons to pause, step and reset a run, and the slider of its speed."""

from nicegui import events, ui

from comply_ros.dashboard.dashboard_node import DashboardNode, PageState
from comply_ros.dashboard.header_bar import succeeds
from comply_ros.dashboard.node_discovery import WORLD

SPEEDS = (0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0, 0.0)


class ControlPanel:
    """Buttons, and the rate that is set beside the one that is measured."""

    def __init__(self, node: DashboardNode) -> None:
        self._node = node
        self._paused: bool | None = None
        self._rate: float | None = None
        self._sent: list[float] = []  # rates that were set here and not reported yet, oldest first
        with ui.column().classes('panel'):
            with ui.row().classes('w-full items-center gap-3'):
                ui.label('Control').classes('panel-title grow')
                self._measured = ui.label().classes('soft number').props(
                    'data-testid=measured-rate')
            with ui.row().classes('w-full items-center gap-2 buttons'):
                self._pause = ui.button(icon='pause', on_click=lambda: succeeds(
                    node.set_paused(not self._paused))).props('data-testid=pause')
                self._step = ui.button('Step', icon='skip_next', on_click=lambda: succeeds(
                    node.step())).props('outline data-testid=step')
                ui.button('Reset', icon='restart_alt', on_click=self._on_reset).props(
                    'outline color=negative data-testid=reset').classes('ml-auto')
            with ui.row().classes('w-full items-center gap-3 no-wrap'):
                self._speed = ui.slider(min=0, max=len(SPEEDS) - 1, step=1, value=0).props(
                    'dense aria-label=speed data-testid=speed').classes('grow')
                self._speed.on('change', self._on_speed)
                self._speed_text = ui.label().classes('soft number').style(
                    'width: 9.5rem; white-space: nowrap').props('data-testid=speed-text')
        self._confirmation = self._make_confirmation()

    def show(self, state: PageState) -> None:
        """Show a state of the page."""
        if state.paused != self._paused:
            self._paused = state.paused
            self._pause.text = 'Resume' if state.paused else 'Pause'
            self._pause.props(f'icon={"play_arrow" if state.paused else "pause"}')
        self._step.set_enabled(state.paused)
        rate = state.parameters.get(WORLD, {}).get('rate')
        if rate is not None and rate.value != self._rate:
            self._rate = rate.value
            self._sent = later_rates(self._sent, rate.value)
            if not self._sent:  # else the slider stays where it was moved to
                self._speed.value = nearest_speed(rate.value)
            self._speed_text.text = speed_text(rate.value)
        self._measured.text = measured_rate_text(state)

    async def _on_speed(self, event: events.GenericEventArguments) -> None:
        rate = SPEEDS[int(event.args)]
        if rate != self._rate or self._sent:
            self._sent.append(rate)
        if not await succeeds(self._node.set_remote_parameter(WORLD, 'rate', rate)):
            self._sent = []
            self._speed.value = nearest_speed(self._rate or 0.0)

    async def _on_reset(self) -> None:
        if await self._confirmation:
            await succeeds(self._node.reset())

    @staticmethod
    def _make_confirmation() -> ui.dialog:
        with ui.dialog() as dialog, ui.card():
            ui.label('Reset the run? The learner forgets everything that it has learned. '
                     'The mentor keeps its policy.')
            with ui.row().classes('w-full justify-end gap-2'):
                ui.button('Cancel', on_click=lambda: dialog.submit(False)).props('flat')
                ui.button('Reset', on_click=lambda: dialog.submit(True)).props(
                    'color=negative data-testid=confirm-reset')
        return dialog


def nearest_speed(rate: float) -> int:
    """Index in `SPEEDS` of the speed that is nearest to a rate; 0.0, without a limit, is last."""
    if not rate:
        return len(SPEEDS) - 1
    return min(range(len(SPEEDS) - 1), key=lambda i: abs(SPEEDS[i] - rate))


def later_rates(sent: list[float], reported: float) -> list[float]:
    """Return which of the rates that were set, in this order, are to be reported after one."""
    return sent[sent.index(reported) + 1:] if reported in sent else []


def speed_text(rate: float) -> str:
    """Text of the rate that is set."""
    return f'{rate:g} step{"" if rate == 1 else "s"} per second' if rate else 'as fast as possible'


def measured_rate_text(state: PageState) -> str:
    """Text of the rate that the world measures."""
    status = state.status(WORLD)
    return f'{status.values.get("steps per second", "?")} steps per second now' if status else ''
