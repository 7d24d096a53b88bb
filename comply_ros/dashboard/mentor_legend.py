# SPDX-License-Identifier: Apache-2.0
"""The legend of several mentors, in which one can be chosen: then only its arrows are shown."""

from functools import partial

from nicegui import ui

from comply_ros.plots.mentor_marks import mentor_color, NO_NAME
from comply_ros.protocol.run_reports import RunReports

ALL = None  # the choice of all mentors


class MentorChoice:
    """
    A button for each mentor, with its name and the confidence in it; hidden while there is one.

    Attributes
    ----------
    chosen: name of the mentor whose arrows are shown, None for all.

    """

    def __init__(self) -> None:
        self.chosen: str | None = ALL
        self._names: tuple[str, ...] = ('',)
        self._buttons: dict[str | None, ui.button] = {}
        self._confidences: dict[str, ui.label] = {}
        self._row = ui.row().classes('w-full items-center mentors').props('data-testid=mentors')
        self._row.visible = False

    def show(self, reports: RunReports) -> None:
        """Show the mentors of a run."""
        names = reports.mentor_names()
        if names != self._names:
            self._names = names
            self._make_buttons()
        for name, label in self._confidences.items():
            confidence = reports.confidence_in(name)
            label.text = '–' if confidence is None else f'{confidence:.2f}'

    @property
    def places(self) -> dict[int, str]:
        """Names of the mentors whose arrows are shown, by their places; of the only one too."""
        return {m: name for m, name in enumerate(self._names) if self.chosen in (ALL, name)}

    def _make_buttons(self) -> None:
        self._row.clear()
        self._row.visible = len(self._names) > 1
        self._buttons, self._confidences = {}, {}
        if self.chosen not in self._names:
            self.chosen = ALL
        if not self._row.visible:
            return
        with self._row:
            with self._add_button(ALL, 'all-mentors'):
                ui.label('all')
            for m, name in enumerate(self._names):
                with self._add_button(name, f'mentor-{name or "unnamed"}'):
                    ui.element('div').classes('dot').style(f'background: {mentor_color(m)}')
                    ui.label(name or NO_NAME).classes('ellipsis mentor-name')
                    self._confidences[name] = ui.label().classes('number soft')
        self._mark()

    def _add_button(self, name: str | None, test_id: str) -> ui.button:
        button = self._buttons[name] = ui.button(on_click=partial(self._choose, name)).props(
            f'flat dense no-caps no-wrap color=grey data-testid={test_id}')
        return button.classes('mentor-button')

    def _choose(self, name: str | None) -> None:
        self.chosen = name
        self._mark()

    def _mark(self) -> None:
        """Mark the button of the choice."""
        for name, button in self._buttons.items():
            is_chosen = name == self.chosen
            button.props(f'aria-pressed={str(is_chosen).lower()}')
            button.classes(**{'add' if is_chosen else 'remove': 'chosen'})
