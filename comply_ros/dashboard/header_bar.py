# SPDX-License-Identifier: Apache-2.0
"""The header of the page: map, method, state of the run, and alarms of lost nodes."""

from collections.abc import Awaitable, Sequence
from typing import Any

from nicegui import ui

from comply_ros.dashboard.dashboard_node import (
    DashboardNode,
    LOST_AFTER,
    PageState,
)
from comply_ros.dashboard.mentor_ownership import MentorSeat
from comply_ros.dashboard.node_discovery import LEARNER, missing_text, WORLD
from comply_ros.dashboard.service_client import ServiceCallError
from comply_ros.dashboard.teaching_offer import teaching_offer
from comply_ros.protocol.messages import WorldDescription


class HeaderBar:
    """Title, state of the run, and an alarm that names missing nodes."""

    def __init__(self, node: DashboardNode, seat: MentorSeat) -> None:
        self._node, self._seat = node, seat
        with ui.row().classes('w-full items-center gap-3 no-wrap'):
            ui.label('comply_ros').classes('text-lg font-semibold')
            self._world = ui.label().classes('soft grow ellipsis')
            self._run_state = ui.badge().props(
                'outline data-testid=run-state').classes('number run-state')
            dark_mode = ui.dark_mode(None)
            with ui.button(icon='contrast', on_click=lambda: dark_mode.set_value(
                    not dark_mode.value)).props(
                    'flat round dense color=grey aria-label="light or dark"'):
                ui.tooltip('light or dark')
        with ui.row().classes('w-full items-center gap-3') as self._watching:
            self._offer = ui.label().classes('grow').props('data-testid=offer')
            with ui.button(on_click=seat.take_over).props(
                    'outline dense no-caps no-wrap padding="4px 10px" data-testid=take-over') \
                    as self._take_over:
                self._hint = ui.tooltip()
        self._start_again = ui.button('Start it again', on_click=node.start_again).props(
            'outline no-caps color=negative data-testid=start-again')
        # At the lower edge of the window: elsewhere it would move what a person paints on.
        self._alarm = ui.label().classes('alarm').props('role=alert data-testid=alarm')

    def show(self, state: PageState) -> None:
        """Show a state of the page."""
        world = state.run.reports.description
        self._world.text = '' if world is None else (
            f'{world.name}, {size_text(world)}, run {world.run}')
        self._run_state.text = text = run_state_text(state)
        self._run_state.classes(replace=f'number run-state {text}')
        mentors = state.other_mentors + (self._seat.thread is not None)
        self._alarm.text = alarm_text(state, mentors)
        self._show_offer(state)
        self._start_again.visible = bool(state.ended)
        self._alarm.visible = bool(self._alarm.text)

    def _show_offer(self, state: PageState) -> None:
        """Offer to teach, on a page that watches and may do more."""
        offer = teaching_offer(state, self._node.mentor_name) \
            if self._seat.can_take_over and self._seat.thread is None else None
        self._watching.visible = offer is not None
        if offer:
            self._offer.text, self._take_over.text, self._hint.text = offer
            self._take_over.visible = bool(offer.button)


def size_text(world: WorldDescription) -> str:
    """Text of how large a world is: of a grid its columns and rows, else its states."""
    rows = world.grid.rows
    return f'{len(rows[0])} x {len(rows)}' if rows else f'{world.states} states'


def run_state_text(state: PageState) -> str:
    """Text of what the run does."""
    if state.run.reports.description is None:
        return 'no world yet'
    if not (state.is_here(WORLD) and state.is_here(LEARNER)):
        return 'stopped'
    if state.paused:
        return 'paused'
    progress = state.run.reports.progress
    return 'finished' if progress and progress.finished else 'running'


def alarm_text(state: PageState, mentors: int = 1) -> str:
    """Sentences on nodes that ended, are lost or missing, and on mentors; '' without any."""
    sentences = [f'{report}\n' for report in state.ended.values()]
    if mentors > max(1, len(state.mentor_names)) and state.is_name_shared:
        sentences.append(shared_name_text(mentors, state.mentor_names))
    sentences += [absence_text(state, role) for role in state.roles
                  if role not in state.ended and not state.is_here(role)]
    return ' '.join(filter(None, sentences))


def shared_name_text(mentors: int, names: Sequence[str]) -> str:
    """Sentence on more mentors than there are names of mentors."""
    if tuple(names) == ('',):
        return (f'{mentors} mentors speak: the learner uses the advice of all, and the same '
                'options need not give the same bits. End all but one.')
    return (f'{mentors} mentors share {len(names)} names: the learner cannot tell those of one '
            'name apart. Give each a name of its own.')


def absence_text(state: PageState, role: str) -> str:
    """Sentence on a role without a node, or with a lost one; '' soon after the start."""
    node = state.roles[role]
    silence = state.silence(node.name)
    if silence is not None:
        how = f'with scripts/run {role}' if node.name == role else 'again'
        return f'The {node.name} has sent no status for {silence:.0f} s: start it {how}.'
    if state.time - state.start_time < LOST_AFTER:
        return ''
    missing = missing_text(role, node)
    return f'{missing[0].upper()}{missing[1:]}: start one with scripts/run {role}.'


def show_error(text: str) -> None:
    """Show a sentence at the top of the page for some seconds."""
    ui.notify(text, type='negative', position='top', multi_line=True, timeout=7000)


async def succeeds(action: Awaitable[Any]) -> bool:
    """Await an action; show its error on the page, and return whether there was none."""
    try:
        await action
    except (ServiceCallError, ValueError) as error:
        show_error(str(error))
        return False
    return True
