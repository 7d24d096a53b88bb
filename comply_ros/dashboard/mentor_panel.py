# SPDX-License-Identifier: Apache-2.0
"""The tools of a human mentor: painting, policy files, generated mentors, and steering."""

import asyncio
import secrets
from typing import Any

from nicegui import events, ui
import numpy as np
from numpy.typing import NDArray

from comply_ros.dashboard.dashboard_node import PageState
from comply_ros.dashboard.header_bar import show_error, succeeds
from comply_ros.dashboard.mentor_thread import MentorThread
from comply_ros.dashboard.page_scripts import STEERING, STEERING_KEYS
from comply_ros.dashboard.paint_tool import FOLLOW, PaintTool
from comply_ros.dashboard.teaching_offer import joining_text, patience_text
from comply_ros.mentor.mentor_spec import FROM_FILES, KINDS, LEARNER, MentorError
from comply_ros.mentor.policy_text import format_policy, parse_policy
from comply_ros.nodes.parameters import PATIENCE
from comply_ros.numerics.rng import SEED_LIMIT
from comply_ros.plots.mentor_marks import mentor_color
from comply_ros.world.grid import DOWN, LEFT, NO_ACTION, RIGHT, UP
from comply_ros.world.mdp import World

TOOLS = {FOLLOW: 'follow', LEFT: '←', RIGHT: '→', DOWN: '↓', UP: '↑', NO_ACTION: 'erase'}
# Names of the actions that the arrow keys advise, in whatever order a world has them.
KEYS = {'ArrowLeft': 'left', 'ArrowRight': 'right', 'ArrowDown': 'down', 'ArrowUp': 'up'}
# Of the kinds with a number: its label, and the value that it begins with.
NUMBERS = {'noisy': ('random share', 0.2), 'snapshot': ('quality', 0.75)}
MAX_FILE_SIZE = 20_000_000  # bytes of a policy file: the largest grid fits, 4096 x 4096


class MentorPanel:
    """Tools for painting, and how far the learner trusts the human mentor."""

    def __init__(self, mentor_thread: MentorThread, paint_tool: PaintTool) -> None:
        self._thread, self._mentor = mentor_thread, mentor_thread.mentor
        self._world: World | None = None
        self._shown_steering: bool | None = None
        with ui.column().classes('panel'):
            with ui.row().classes('w-full items-center gap-3'):
                self._dot = ui.element('div').classes('dot')
                ui.label('You are the mentor').classes('panel-title')
                ui.label(self._mentor.machine.name).classes('grow ellipsis').props(
                    'data-testid=own-name')
                self._trust = ui.label().classes('number').props('data-testid=trust')
            self._joining = ui.label().props('data-testid=joining')
            self._make_paint_tools(paint_tool)
            with ui.row().classes('w-full items-center gap-2'):
                self._make_generator()
                ui.space()
                self._make_files()
            self._make_spoiler()
            self._make_steering()

    def show(self, state: PageState) -> None:
        """Show a state of the page."""
        self._world = world = state.run.world
        self._tools.visible = self._help.visible = world is None or world.model == 'grid'
        self._steering_row.visible = world is None or bool(steering_actions(world))
        name, names = self._mentor.machine.name, state.run.reports.mentor_names()
        self._trust.text = trust_text(state, name)
        self._joining.text = joining_text(state, name)
        self._joining.visible = bool(self._joining.text)
        self._dot.visible = len(names) > 1 and name in names
        if self._dot.visible:
            self._dot.style(f'background: {mentor_color(names.index(name))}')
        if self._mentor.steering != self._shown_steering:
            self._shown_steering = self._steering.value = self._mentor.steering
            self._keys.props(f'{STEERING}={str(self._shown_steering).lower()}')
        self._patience.text = patience_text(
            state, name, self._mentor.get_parameter(PATIENCE.name).value)

    def _make_paint_tools(self, paint_tool: PaintTool) -> None:
        with ui.row().classes('w-full items-center gap-2'):
            self._tools = ui.toggle(TOOLS, value=FOLLOW).bind_value_to(paint_tool, 'tool').props(
                'no-caps dense unelevated toggle-color=primary padding="4px 12px" '
                'data-testid=tools')
            ui.space()
            ui.button('Clear', icon='layers_clear', on_click=lambda: self._change('erase')).props(
                'flat dense no-caps data-testid=clear')
        self._help = ui.label(
            'Drag over cells to paint arrows: with "follow" they point where you drag. Click a '
            'cell to change its arrow. On a touch screen, two fingers scroll the '
            'page.').classes('soft')

    def _make_files(self) -> None:
        upload = self._upload = ui.upload(
            on_upload=self._on_upload, auto_upload=True, max_file_size=MAX_FILE_SIZE,
            on_rejected=lambda: show_error(
                f'a policy file must have at most {MAX_FILE_SIZE} bytes')).classes('hidden')
        ui.button('Load', icon='upload', on_click=lambda: upload.run_method('pickFiles')).props(
            'flat dense no-caps data-testid=load')
        ui.button('Save', icon='download', on_click=self._on_save).props(
            'flat dense no-caps data-testid=save')

    def _make_generator(self) -> None:
        kinds = [kind for kind in KINDS if kind not in (*FROM_FILES, LEARNER, 'none')]
        self._kind = ui.select(kinds, value='snapshot').props(
            'dense outlined options-dense aria-label="kind of mentor" data-testid=kind')
        self._numbers = {kind: ui.number(label, value=value, min=0, max=1, step=0.05).props(
            f'dense outlined data-testid={kind}-number').style('width: 7rem').bind_visibility_from(
                self._kind, 'value', value=kind) for kind, (label, value) in NUMBERS.items()}
        self._seed = ui.number('seed', value=0, min=0, precision=0).props(
            'dense outlined').style('width: 5rem')
        self._generate = ui.button('Generate', on_click=self._on_generate).props(
            'outline dense no-caps padding="4px 10px" data-testid=generate')

    def _make_spoiler(self) -> None:
        with ui.row().classes('w-full items-center gap-3 no-wrap'):
            share = ui.slider(min=0, max=100, step=5, value=20).props(
                'dense aria-label="share of states"').classes('grow').style('max-width: 14rem')
            ui.label().classes('soft number').style('min-width: 6.5rem').bind_text_from(
                share, 'value', lambda value: f'{value:.0f} % of states')
            with ui.button('Spoil', icon='casino', on_click=lambda: self._change(
                    'spoil', share.value / 100, secrets.randbelow(2 ** 32))).props(
                    'outline dense no-caps no-wrap padding="4px 10px" data-testid=spoil').classes(
                        'shrink-0'):
                ui.tooltip('put random actions into this share of the states')

    def _make_steering(self) -> None:
        with ui.row().classes('w-full items-center gap-3') as self._steering_row:
            self._steering = ui.switch('steer with the arrow keys').props(
                'dense data-testid=steering').classes('steering-switch')
            self._steering.on('update:model-value', self._on_steering)
            self._patience = ui.label().classes('soft')
        ui.keyboard(self._on_key, ignore=['input', 'select', 'textarea'])
        self._keys = ui.element('div').props(f'{STEERING}=false').classes('hidden')
        ui.add_body_html(STEERING_KEYS)
        self._client = ui.context.client
        self._client.on_disconnect(self._on_leave)
        self._client.on_delete(self._on_leave)

    async def _on_steering(self) -> None:
        if self._steering.value:
            self._thread.steering_page = self._client.id
        await succeeds(asyncio.wrap_future(self._thread.set_steering(self._steering.value)))

    def _on_leave(self) -> None:
        """Switch off steering where this page has switched it on: nobody would steer."""
        if self._thread.steering_page == self._client.id:
            self._thread.steering_page = ''
            self._thread.set_steering(False)

    async def _call(self, name: str, *arguments: Any) -> None:
        await succeeds(asyncio.wrap_future(self._thread.call(name, *arguments)))

    async def _change(self, name: str, *arguments: Any) -> None:
        if self._policy() is not None:
            await self._call(name, *arguments)

    async def _on_key(self, event: events.KeyEventArguments) -> None:
        actions = steering_actions(self._world) if self._world else {}
        if event.key.name in actions and self._mentor.steering and event.action.keydown:
            await self._call('steer', actions[event.key.name])

    def _policy(self) -> NDArray[np.int8] | None:
        """Return the painted policy; where there is no world yet, show that and return None."""
        policy = self._mentor.policy
        if policy is None or self._world is None or len(policy) != len(self._world.free):
            show_error('a policy needs a world, and none is known yet: start grid_world')
            return None
        return policy

    def _on_save(self) -> None:
        policy = self._policy()
        if policy is not None:
            ui.download.content(format_policy(policy, self._world), 'mentor.txt', 'text/plain')

    async def _on_upload(self, event: events.UploadEventArguments) -> None:
        self._upload.reset()
        if self._policy() is None:
            return
        try:
            policy = parse_policy((await event.file.read()).decode(), self._world)
        except UnicodeDecodeError:
            show_error(f'a policy file must be text, got {event.file.name!r}')
        except ValueError as error:
            show_error(f'{event.file.name}: {error}')
        else:
            await self._call('use', policy)

    async def _on_generate(self) -> None:
        if self._policy() is None:
            return
        kind, seed = self._kind.value, self._seed.value
        spec = f'{kind}:{self._numbers[kind].value}' if kind in NUMBERS else kind
        self._generate.props('loading')
        try:
            if seed is None or not 0 <= seed <= SEED_LIMIT:
                raise MentorError(f'seed must lie in [0, {SEED_LIMIT}], got {seed}')
            used = await asyncio.wrap_future(self._thread.call('begin_from', spec, int(seed)))
            await asyncio.wrap_future(used)
        except (ArithmeticError, ValueError) as error:
            show_error(str(error))
        finally:
            self._generate.props(remove='loading')


def steering_actions(world: World) -> dict[str, int]:
    """Return the action of a world for each arrow key; empty if its actions are no directions."""
    names = world.action_names
    return {key: names.index(name) for key, name in KEYS.items() if name in names}


def trust_text(state: PageState, name: str = '') -> str:
    """Text of how far the learner trusted the mentor of the page in the last iteration."""
    confidence = state.run.reports.confidence_in(name)
    return 'no trust yet: no decision had advice' if confidence is None \
        else f'trust in you {confidence:.2f}'
