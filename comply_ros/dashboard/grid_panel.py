# SPDX-License-Identifier: Apache-2.0
"""The picture of the world: the robot, the mentor's and the learner's arrows, and painting."""

import asyncio
from collections.abc import Callable
from functools import partial
from typing import Any

from nicegui import events, ui
import numpy as np

from comply_ros.dashboard import grid_svg, state_svg
from comply_ros.dashboard.dashboard_node import PageState, RunSnapshot
from comply_ros.dashboard.header_bar import succeeds
from comply_ros.dashboard.mentor_legend import MentorChoice
from comply_ros.dashboard.mentor_thread import MentorThread
from comply_ros.dashboard.page_scripts import POINTER, POINTER_EVENTS
from comply_ros.dashboard.paint_tool import PaintTool
from comply_ros.plots.state_layout import layout_of
from comply_ros.protocol.state_maps import MentorReports
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.mdp import World


class GridPanel:
    """A picture in layers, of which only those that have changed are sent to the browser."""

    def __init__(self, mentor_thread: MentorThread | None) -> None:
        self.paint_tool, self._thread = PaintTool(), mentor_thread
        self._world: World | None = None
        self._shown: dict[str, tuple] = {}  # by layer: what was drawn
        self._painters: dict[str, Callable[..., str]] = {}
        with ui.column().classes('panel'):
            # One line whatever the step id is: two would move the picture that a person paints on.
            with ui.row().classes('w-full items-center gap-3 no-wrap'):
                ui.label('World').classes('panel-title')
                self._step_id = ui.label().classes('soft number grow ellipsis').props(
                    'data-testid=step-id')
            self._frame = ui.element('div').classes('w-full')
            self._choice = MentorChoice()
            self._show_learner = ui.switch("learner's arrows").props(
                'dense data-testid=learner-arrows')
            self._make_legend()

    def _make_legend(self) -> None:
        """Make what tells the colors of one mentor's arrows, and the looks of those of several."""
        with ui.row().classes('items-center gap-2 soft'):
            with ui.row().classes('items-center gap-2') as self._scale:
                ui.label("mentor's arrows: not trusted")
                ui.element('div').classes('scale')
                ui.label('trusted')
                with ui.row().classes('items-center gap-2 no-wrap'):
                    ui.element('div').classes('dot')
                    ui.label('never visited')
            self._of_several = ui.label("mentors' arrows: the fainter, the less they are trusted; "
                                        'outlines where the learner was never')
            self._note = ui.label()

    def show(self, state: PageState) -> None:
        """Show a state of the page."""
        run, reports = state.run, state.run.reports
        if run.world is None:
            return
        if run.world is not self._world:
            self._make_picture(run.world)
        msg = reports.observation
        self._step_id.text = f'episode {msg.episode}, step {msg.step}' if msg else ''
        waits = bool(self._thread and self._thread.mentor.steering and msg)
        self._show_mentors(run)
        self._draw('learner', 'learner', reports.policy if self._show_learner.value else None)
        self._draw('robot', 'robot', msg and msg.state, waits)

    def _show_mentors(self, run: RunSnapshot) -> None:
        """Show the arrows of the mentor that is chosen, or of all."""
        reports = run.reports
        self._choice.show(reports)
        known = {m: self._known_of(run, name) for m, name in self._choice.places.items()}
        several = len(known) > 1
        self._scale.visible, self._of_several.visible = not several, several
        if several:
            self._draw('mentor', 'mentors', known, reports.policy)
        else:
            mentor, = known.values()
            self._draw('mentor', 'mentor', mentor.policy, mentor.trust, reports.policy)

    def _make_picture(self, world: World) -> None:
        """Make the picture of a world, without arrows and robot."""
        self._world, self._shown = world, {}
        self._frame.clear()
        is_painted = bool(self._thread and world.model == 'grid')
        self._painters, (width, height), content = _picture_of(world)
        self._note.text = _note_on(world)
        with self._frame:
            image = ui.interactive_image(
                size=(width, height), content=content, sanitize=False, events=[])
        for event in POINTER_EVENTS if is_painted else ():
            image.on(event, self._on_pointer, js_handler=POINTER)
        image.classes('world painting' if is_painted else 'world').style(
            f'--shape: {width / height:.4f}; --tall: {"55vh" if self._thread else "70vh"}')
        self._layers = {name: image.add_layer() for name in ('mentor', 'learner', 'robot')}

    def _draw(self, layer: str, painter: str, *shown: Any) -> None:
        """Draw a layer if what it shows has changed; nothing where the first of it is None."""
        before = self._shown.get(layer)
        if before is None or not is_same_picture(before, (painter, *shown)):
            self._shown[layer] = painter, *shown
            self._layers[layer].content = '' if shown[0] is None \
                else self._painters[painter](*shown)

    def _known_of(self, run: RunSnapshot, name: str) -> MentorReports:
        """Return what is known of a mentor; a policy that is painted here needs no topic."""
        known, mentor = run.reports.of_mentor(name), self._thread and self._thread.mentor
        painted = mentor.policy if mentor and mentor.machine.name == name else None
        if painted is not None and run.world and len(painted) == len(run.world.free):
            return known._replace(policy=painted)
        return known

    async def _on_pointer(self, event: events.GenericEventArguments) -> None:
        world, tool, thread = self._world, self.paint_tool, self._thread
        if world is None or thread is None or world.model != 'grid':
            return
        kind, cells = event.args['type'], {}
        width, height = grid_svg.size(world.grid)
        s = grid_svg.state_at(world.grid, width * event.args['x'], height * event.args['y'])
        if kind == 'pointercancel':
            tool.cancel()
        elif kind == 'pointerdown':
            cells = tool.press(world, s, event.args['touch'])
        elif kind == 'pointerup':
            policy = thread.mentor.policy
            cells = tool.release(world, np.full(len(world.free), NO_ACTION, dtype=np.int8)
                                 if policy is None else policy)
        else:
            cells = tool.move(world, s)
        if cells:
            await succeeds(asyncio.wrap_future(thread.call('paint', cells)))


def is_same_picture(before: tuple[Any, ...], now: tuple[Any, ...]) -> bool:
    """Tell whether what is shown are the same objects, of several mentors those known of each."""
    def parts(shown: tuple[Any, ...]) -> list[Any]:
        return [part for each in shown for part in (
            [*each, *(array for known in each.values() for array in known[:2])]
            if isinstance(each, dict) else [each])]
    old, new = parts(before), parts(now)
    return len(old) == len(new) and all(a is b for a, b in zip(old, new))


def _picture_of(world: World) -> tuple[dict[str, Callable[..., str]], tuple[int, int], str]:
    """Return what draws each layer of a world, the size of its picture, and what never moves."""
    if world.model == 'grid':
        return ({'mentor': partial(grid_svg.mentor_arrows, world),
                 'mentors': partial(grid_svg.arrows_of_mentors, world),
                 'learner': partial(grid_svg.learner_arrows, world),
                 'robot': partial(grid_svg.robot, world.grid)},
                grid_svg.size(world.grid), grid_svg.cells(world))
    layout = layout_of(world)
    return ({'mentor': partial(state_svg.mentor_arrows, world, layout),
             'mentors': partial(state_svg.arrows_of_mentors, world, layout),
             'learner': partial(state_svg.learner_arrows, world, layout),
             'robot': partial(state_svg.robot, layout)},
            state_svg.size(layout), state_svg.cells(world, layout))


def _note_on(world: World) -> str:
    """Sentence on what the picture of a world lacks; empty if it lacks nothing."""
    if len(world.free) > grid_svg.MAX_CELLS:
        return f'(arrows are drawn for at most {grid_svg.MAX_CELLS} cells)'
    if world.model == 'grid':
        return ''
    return '(a cell for each state; nothing can be painted)'
