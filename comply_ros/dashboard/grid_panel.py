# SPDX-License-Identifier: Apache-2.0
"""The grid: the robot, the mentor's arrows and the learner's, and what the pointer paints."""

from nicegui import ui

from comply_ros.dashboard.grid_svg import (
    cell_at,
    draw_advice,
    draw_cells,
    draw_policy,
    draw_robot,
    MOST_ARROWS,
    picture_size,
)
from comply_ros.dashboard.notifications import say_if_refused
from comply_ros.dashboard.paint_tool import PaintTool
from comply_ros.world.grid import NO_ACTION


class GridPanel:
    """
    Picture in layers: only what has changed is sent to the browser.

    Attributes
    ----------
    brush: the `PaintTool` of this page.

    """

    def __init__(self, teacher):
        self.brush, self._teacher = PaintTool(), teacher
        self._world, self._drawn, self._layers = None, {}, {}
        with ui.column().classes('panel'):
            with ui.row().classes('w-full items-center gap-3'):
                ui.label('World').classes('panel-title')
                self._turn = ui.label().classes('soft number grow').props('data-testid=turn')
                self._own = ui.switch("learner's arrows").props('dense').props('data-testid=own')
            self._place = ui.element('div').classes('w-full')
            with ui.row().classes('items-center gap-2 soft'):
                ui.label("mentor's arrows: not trusted")
                ui.element('div').classes('scale')
                ui.label('trusted')
                self._note = ui.label()

    def renew(self, view):
        """Show a `View`."""
        sight = view.sight
        if sight.world is None:
            return
        if sight.world is not self._world:
            self._make_picture(sight.world)
        self._draw('advice', draw_advice, sight.world, self._advice(sight), sight.heard.trust)
        self._draw('own', draw_policy, sight.world,
                   sight.heard.policy if self._own.value else None)
        question = sight.heard.question
        self._draw('robot', draw_robot, sight.world.grid, question and question.state,
                   self._waits(question))
        self._turn.text = '' if question is None else (
            f'episode {question.episode}, step {question.step}')

    def _make_picture(self, world):
        """Make an empty picture for a world."""
        self._world, self._drawn = world, {}
        self._place.clear()
        width, height = picture_size(world.grid)
        self._note.text = '' if len(world.free) <= MOST_ARROWS else (
            f'(no arrows are drawn in more than {MOST_ARROWS} cells)')
        with self._place:
            self._image = ui.interactive_image(
                size=(width, height), content=draw_cells(world), sanitize=False,
                on_mouse=self._hear_pointer if self._teacher else None,
                events=['mousedown', 'mousemove', 'mouseup'] if self._teacher else [])
        self._image.classes('world').style(
            f'--shape: {width / height:.4f}; --tall: {"55vh" if self._teacher else "70vh"}')
        if self._teacher:
            self._image.classes('painting')
        self._layers = {name: self._image.add_layer() for name in ('advice', 'own', 'robot')}

    def _draw(self, name, draw, world, *what):
        """Draw a layer anew if what it shows is another; nothing where the first of it is None."""
        before = self._drawn.get(name)
        if before is not None and all(a is b for a, b in zip(before, what)):
            return
        self._drawn[name] = what
        self._layers[name].content = '' if what[0] is None else draw(world, *what)

    def _advice(self, sight):
        """Return the mentor's arrows: what is painted here is seen before it went round."""
        own = self._teacher and self._teacher.mentor.policy
        return own if own is not None and len(own) == len(sight.world.free) else sight.heard.advice

    def _waits(self, question):
        return bool(self._teacher and self._teacher.mentor.steering and question)

    def _hear_pointer(self, event):
        world, brush = self._world, self.brush
        s = cell_at(world.grid, event.image_x, event.image_y)
        if event.type == 'mousedown':
            self._paint(brush.press(world, s))
        elif event.type == 'mouseup' or brush.paints and not event.buttons:
            policy = self._teacher.mentor.policy
            self._paint(brush.lift(world, [NO_ACTION] * len(world.free) if policy is None
                                   else policy))
        elif brush.paints:
            self._paint(brush.move(world, s))

    def _paint(self, cells):
        if cells:
            say_if_refused(self._teacher.do('paint', cells))
