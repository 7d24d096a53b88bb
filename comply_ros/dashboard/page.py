# SPDX-License-Identifier: Apache-2.0
"""One open page: its panels, each renewed ten times a second from what is known then."""

from nicegui import ui

from comply_ros.dashboard.control_panel import ControlPanel
from comply_ros.dashboard.curve_panel import CurvePanel
from comply_ros.dashboard.grid_panel import GridPanel
from comply_ros.dashboard.header_bar import HeaderBar
from comply_ros.dashboard.health_panel import HealthPanel
from comply_ros.dashboard.mentor_panel import MentorPanel
from comply_ros.dashboard.parameters_panel import SettingsPanel
from comply_ros.dashboard.style import CSS

RENEWAL = 0.1  # seconds


def show(watcher, teacher):
    """Build the page for one visitor; teacher: a `MentorThread`, or None where nobody teaches here."""
    ui.add_css(CSS)
    ui.colors(primary='#0072B2', positive='#009E73', negative='#CC3311', warning='#E69F00')
    with ui.column().classes('frame'):
        panels = [HeaderBar()]
        with ui.element('div').classes('columns'):
            with ui.column().classes('side'):
                grid = GridPanel(teacher)
                panels.append(grid)
                if teacher:
                    panels.append(MentorPanel(teacher, grid.brush))
            with ui.column().classes('side'):
                panels += [CurvePanel(), ControlPanel(watcher), HealthPanel(),
                           SettingsPanel(watcher)]

    def renew():
        for panel in panels:
            panel.renew(watcher.view)
    renew()
    ui.timer(RENEWAL, renew)
