# SPDX-License-Identifier: Apache-2.0
"""The page: its panels, how they look, and their renewal up to ten times a second."""

import asyncio
from collections.abc import Awaitable, Callable
from contextlib import suppress
from typing import Any

from nicegui import app, ui

from comply_ros.dashboard.confidence_panel import ConfidencePanel
from comply_ros.dashboard.control_panel import ControlPanel
from comply_ros.dashboard.curve_panel import CurvePanel
from comply_ros.dashboard.dashboard_node import DashboardNode
from comply_ros.dashboard.grid_panel import GridPanel
from comply_ros.dashboard.header_bar import HeaderBar
from comply_ros.dashboard.health_panel import HealthPanel
from comply_ros.dashboard.mentor_ownership import MentorSeat
from comply_ros.dashboard.mentor_panel import MentorPanel
from comply_ros.dashboard.parameters_panel import ParametersPanel
from comply_ros.dashboard.picture_panel import PicturePanel
from comply_ros.plots.trust_colors import trust_color

PERIOD = 0.1  # seconds between two renewals, at least
ANSWER_TIMEOUT = 10.0  # seconds that a renewal waits for a browser that does not answer
CSS = """
:root { --cell: #ffffff; --line: #e3e6ea; --wall: #aeb6c0; --ink: #1f2933; --soft: #5d6875;
        --learner: #0072B2; --halo: #ffffff; --page: #f3f5f7; --unknown: #9aa3ad;
        --good: #00704f; --bad: #b92c0d; --warn: #8a5a00; }
.body--dark { --cell: #20262d; --line: #2f3740; --wall: #56616d; --ink: #e8ecf0; --soft: #9aa7b4;
        --learner: #6cbcf0; --halo: #14181c; --page: #14181c; --unknown: #7b8794;
        --good: #3cc79a; --bad: #ff8f78; --warn: #f0b840; }
body { background: var(--page); color: var(--ink); } .nicegui-content { padding: 0; }
.frame { width: 100%; max-width: 1500px; margin: 0 auto; padding: 12px 16px 96px; gap: 12px; }
.columns { display: grid; width: 100%; gap: 12px; align-items: start;
           grid-template-columns: minmax(0, 1.15fr) minmax(0, 1fr); }
.side { width: 100%; gap: 12px; flex-wrap: nowrap; }
.panel { width: 100%; gap: 8px; padding: 12px 14px; border-radius: 10px; box-shadow: none;
         border: 1px solid var(--line); background: var(--cell); flex-wrap: nowrap; }
.panel-title { font-size: 0.78rem; font-weight: 600; letter-spacing: 0.05em; color: var(--soft);
               text-transform: uppercase; min-height: 0; }
.q-item.panel-title .q-item__label { white-space: nowrap; }
.body--dark :is(.q-btn.text-primary, .q-field, .q-menu) { --q-primary: #6cbcf0; }
.chart text { fill: var(--soft) !important; }
.run-state { --q-primary: var(--soft); }
.run-state.running { --q-primary: var(--good); }
.run-state.paused { --q-primary: var(--warn); }
.run-state.stopped { --q-primary: var(--bad); }
.body--dark .q-btn.text-negative { --q-negative: #ff8f78; }
.soft { color: var(--soft); font-size: 0.85rem; }
.number { font-variant-numeric: tabular-nums; }
.grow { flex: 1 1 auto; min-width: 0; }
.world { width: 100%; max-width: min(100%, calc(var(--shape) * var(--tall))); margin: 0 auto;
         user-select: none; }
.world svg { overflow: visible; }
.world.painting { cursor: crosshair; touch-action: pinch-zoom; -webkit-touch-callout: none; }
.picture { width: 100%; } .picture img { max-height: 34vh; object-fit: contain; }
.lines, .frames { stroke: var(--line); stroke-width: 1; fill: none; }
.pit { fill: var(--wall); opacity: 0.7; } text.learner { fill: var(--learner); stroke: none; }
.wall { fill: var(--wall); } .goal { fill: var(--ink); }
.start { fill: var(--learner); opacity: 0.22; } .unknown { fill: var(--unknown); }
.learner { fill: none; stroke: var(--learner); stroke-width: 2.6; stroke-linecap: round;
           stroke-linejoin: round; }
.halo { fill: none; stroke: var(--halo); stroke-width: 5.4; stroke-linecap: round;
        stroke-linejoin: round; opacity: 0.75; }
.mentor { fill: currentColor; }
.never-visited { fill: none; stroke: currentColor; stroke-width: 2; }
.mentors { gap: 6px; } .mentor-name { max-width: 9rem; }
.mentor-button { border: 1px solid var(--line); border-radius: 14px; padding: 1px 10px; }
.mentor-button .q-btn__content { gap: 6px; color: var(--ink); }
.mentor-button.chosen { border-color: var(--ink); background: var(--page); }
.robot circle { fill: #6d3fc0; stroke: var(--halo); stroke-width: 2; }
.robot .eye { fill: #ffffff; stroke: none; }
.waits { fill: none; stroke: #6d3fc0; stroke-width: 3; animation: waits 0.8s infinite alternate; }
@keyframes waits { from { opacity: 0.15; } to { opacity: 1; } }
.alarm { position: fixed; inset: auto 16px 12px; max-width: 1468px; max-height: 40vh;
         z-index: 1000; margin: 0 auto; overflow-y: auto; padding: 8px 14px; border-radius: 10px;
         font-weight: 500; background: #fbe3dc; color: #8a1f09; }
.alarm { white-space: pre-wrap; overflow-wrap: anywhere; }
.body--dark .alarm { background: #43190f; color: #ffb9a7; }
.scale { height: 8px; width: 110px; border-radius: 4px; background: linear-gradient(
         90deg, var(--q-negative), var(--q-warning), var(--q-positive)); }
.dot { width: 10px; height: 10px; border-radius: 50%; flex: none; background: var(--unknown); }
.well { background: var(--q-positive); } .waiting { background: var(--q-warning); }
.ill { background: var(--q-negative); }
.node { display: grid; grid-template-columns: 10px 7.2rem minmax(0, 1fr); gap: 10px;
        align-items: baseline; width: 100%; font-size: 0.88rem; }
.node > * { min-width: 0; overflow-wrap: anywhere; }
.words { overflow-wrap: anywhere; color: var(--soft); }
.parameter { display: grid; grid-template-columns: minmax(0, 1fr) 9.5rem; gap: 10px; width: 100%;
             align-items: center; }
.parameter-name { font-size: 0.88rem; } .parameter-text { font-size: 0.76rem; color: var(--soft); }
@media (max-width: 1000px) { .columns { grid-template-columns: minmax(0, 1fr); } }
@media (max-width: 480px) {
  .scale { width: 16vw; } .parameter { grid-template-columns: minmax(0, 1fr) 7rem; }
  .buttons .q-btn { padding: 4px 12px; } }
"""


def build_page(node: DashboardNode, seat: MentorSeat) -> None:
    """Build the page for one visitor, who is the mentor while `seat` has one."""
    mentor_thread = seat.thread
    ui.add_css(CSS)
    ui.colors(primary='#0072B2', positive=trust_color(1.0), negative=trust_color(0.0),
              warning=trust_color(0.5))
    with ui.column().classes('frame'):
        panels: list[Any] = [HeaderBar(node, seat)]
        with ui.element('div').classes('columns'):
            with ui.column().classes('side'):
                grid = GridPanel(mentor_thread)
                panels.append(grid)
                if mentor_thread:
                    panels.append(MentorPanel(mentor_thread, grid.paint_tool))
            with ui.column().classes('side'):
                panels += [CurvePanel(), ConfidencePanel(), ControlPanel(node), PicturePanel(node),
                           HealthPanel(), ParametersPanel(node)]

    def show() -> None:
        for panel in panels:
            panel.show(node.page_state)

    client = ui.context.client

    async def browser_answers() -> None:
        with suppress(TimeoutError):
            await client.run_javascript('null', timeout=ANSWER_TIMEOUT)

    async def renew() -> None:
        await keep_showing(show, lambda: seat.thread is not mentor_thread, browser_answers)
        ui.navigate.reload()  # with the tools of a mentor, or without
    show()
    # A `ui.timer` that repeats measures by the system clock; asyncio.sleep has a steady one.
    ui.timer(0.0, renew, once=True)


async def keep_showing(show: Callable[[], None], is_outdated: Callable[[], bool],
                       browser_answers: Callable[[], Awaitable[None]]) -> None:
    """
    Show the state every 0.1 s until the page is outdated, or is closed, which cancels this.

    browser_answers: returns when the browser has drawn level. A slow one is sent less: what waits
        for it would keep it from what its user does.
    """
    while not is_outdated():
        try:
            show()
        except Exception as error:  # noqa: BLE001 - it is logged, and the page goes on
            app.handle_exception(error)
        await asyncio.gather(asyncio.sleep(PERIOD), browser_answers())
