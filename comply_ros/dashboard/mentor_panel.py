# SPDX-License-Identifier: Apache-2.0
"""Where a person is the mentor: brush, policy files, generated mentors, and steering."""

import asyncio
import secrets

from nicegui import ui

from comply_ros.dashboard.notifications import complain, say_if_refused
from comply_ros.dashboard.paint_tool import FOLLOW
from comply_ros.mentor.advice_budget import MentorError
from comply_ros.mentor.mentor_policies import KINDS
from comply_ros.mentor.policy_text import format_policy, parse_policy, PolicyError
from comply_ros.numerics.rng import SEED_LIMIT
from comply_ros.world.grid import ARROWS, DOWN, LEFT, NO_ACTION, RIGHT, UP

TOOLS = {FOLLOW: 'follow', **{a: '←→↓↑'[a] for a in range(len(ARROWS))}, NO_ACTION: 'erase'}
KEYS = {'ArrowLeft': LEFT, 'ArrowRight': RIGHT, 'ArrowDown': DOWN, 'ArrowUp': UP}
LARGEST = 20_000_000  # bytes of a policy file: a line for each of 4096 rows fits


class MentorPanel:
    """Tools for painting, and how far the learner trusts the person."""

    def __init__(self, teacher, brush):
        self._teacher, self._brush, self._world = teacher, brush, None
        with ui.column().classes('panel'):
            with ui.row().classes('w-full items-center gap-3'):
                ui.label('You are the mentor').classes('panel-title grow')
                self._trust = ui.label().classes('number').props('data-testid=trust')
            self._make_brush()
            with ui.row().classes('w-full items-center gap-2'):
                self._make_generator()
                ui.space()
                self._make_files()
            self._make_spoiler()
            self._make_steering()

    def renew(self, view):
        """Show a `View`."""
        self._world = view.sight.world
        self._trust.text = trust_words(view)
        self._steering.value = self._teacher.mentor.steering
        self._patience.text = f'the robot waits {self._teacher.patience:g} s for a key'

    def _make_brush(self):
        with ui.row().classes('w-full items-center gap-2'):
            tools = ui.toggle(TOOLS, value=FOLLOW, on_change=lambda event: setattr(
                self._brush, 'tool', event.value))
            tools.props('no-caps dense unelevated toggle-color=primary padding="4px 12px"')
            tools.props('data-testid=tools')
            ui.space()
            ui.button('Clear', icon='layers_clear', on_click=self._clear).props(
                'flat dense no-caps').props('data-testid=clear')
        ui.label('Drag over cells: arrows follow the pointer, or are those of the tool. '
                 'A click turns an arrow.').classes('soft')

    def _make_files(self):
        self._upload = ui.upload(
            on_upload=self._load, auto_upload=True, max_file_size=LARGEST,
            on_rejected=lambda: complain(f'a policy file must have at most {LARGEST} bytes'))
        self._upload.classes('hidden')
        ui.button('Load', icon='upload', on_click=lambda: self._upload.run_method(
            'pickFiles')).props('flat dense no-caps').props('data-testid=load')
        ui.button('Save', icon='download', on_click=self._save).props(
            'flat dense no-caps').props('data-testid=save')

    def _make_generator(self):
        kinds = [kind for kind in KINDS if kind not in ('file', 'none')]
        self._kind = ui.select(kinds, value='snapshot').props(
            'dense outlined options-dense aria-label="kind of mentor"').props('data-testid=kind')
        self._value = ui.number(value=0.75, min=0, max=1, step=0.05).props(
            'dense outlined aria-label="quality or noise"').style('width: 5rem')
        self._value.bind_visibility_from(self._kind, 'value', lambda kind: ':' in KINDS[kind])
        self._seed = ui.number(value=0, min=0, precision=0, prefix='seed').props(
            'dense outlined aria-label=seed').style('width: 6rem')
        self._use = ui.button('Start from it', on_click=self._generate).props(
            'outline dense no-caps padding="4px 10px"').props('data-testid=generate')

    def _make_spoiler(self):
        with ui.row().classes('w-full items-center gap-3 no-wrap'):
            ui.label('Spoil').classes('soft')
            share = ui.slider(min=0, max=100, step=5, value=20).props(
                'dense aria-label="share of states"').classes('grow').style('max-width: 14rem')
            ui.label().classes('soft number').style('width: 6.5rem').bind_text_from(
                share, 'value', lambda value: f'{value:.0f} % of states')
            ui.button('Spoil', icon='casino', on_click=lambda: self._spoil(
                share.value / 100)).props(
                    'outline dense no-caps padding="4px 10px" data-testid=spoil')

    def _make_steering(self):
        with ui.row().classes('w-full items-center gap-3 no-wrap'):
            self._steering = ui.switch('steer with the arrow keys').props('dense')
            self._steering.on('update:model-value', lambda: say_if_refused(
                self._teacher.take_the_wheel(self._steering.value)))
            self._patience = ui.label().classes('soft')
        ui.keyboard(self._hear_key, ignore=['input', 'select', 'textarea'])

    def _do(self, deed, *arguments):
        say_if_refused(self._teacher.do(deed, *arguments))

    def _hear_key(self, event):
        if event.key.name in KEYS and self._teacher.mentor.steering and event.action.keydown:
            self._do('steer', KEYS[event.key.name])

    def _policy(self):
        """Return the painted policy, or None with a complaint where there is no world yet."""
        policy = self._teacher.mentor.policy
        if policy is None or self._world is None or len(policy) != len(self._world.free):
            complain('a policy is painted in a world, and none is heard yet: start grid_world')
            return None
        return policy

    def _clear(self):
        if self._policy() is not None:
            self._do('erase')

    def _save(self):
        policy = self._policy()
        if policy is not None:
            ui.download.content(format_policy(policy, self._world), 'mentor.txt', 'text/plain')

    async def _load(self, event):
        self._upload.reset()
        if self._policy() is None:
            return
        try:
            text = (await event.file.read()).decode()
            self._do('use', parse_policy(text, self._world))
        except UnicodeDecodeError:
            complain(f'a policy file must be text, got {event.file.name!r}')
        except PolicyError as error:
            complain(f'{event.file.name}: {error}')

    async def _generate(self):
        if self._policy() is None:
            return
        self._use.props('loading')
        try:
            seed = checked_seed(self._seed.value)
            made = await asyncio.wrap_future(self._teacher.do('begin_from', self._spec(), seed))
            await asyncio.wrap_future(made)
        except (ArithmeticError, ValueError) as error:
            complain(str(error))
        finally:
            self._use.props(remove='loading')

    def _spec(self):
        kind = self._kind.value
        valued = ':' in KINDS[kind]
        return f'{kind}:{self._value.value}' if valued else kind

    def _spoil(self, share):
        if self._policy() is not None:
            self._do('spoil', share, secrets.randbelow(2 ** 32))


def checked_seed(value):
    """
    Return a seed as an int.

    Raises
    ------
    MentorError: for one out of its range.

    """
    if value is None or not 0 <= value <= SEED_LIMIT:
        raise MentorError(f'seed must lie in [0, {SEED_LIMIT}], got {value}')
    return int(value)


def trust_words(view):
    """Words on how far the learner trusted the person in the last iteration."""
    msg = view.sight.heard.progress
    if msg is None or msg.confidence != msg.confidence:
        return 'no trust yet: no decision had advice'
    return f'trust in you {msg.confidence:.2f}'
