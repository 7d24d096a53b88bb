# SPDX-License-Identifier: Apache-2.0
"""How the page looks, light and dark, wide and narrow."""

CSS = """
:root { --cell: #ffffff; --line: #e3e6ea; --wall: #aeb6c0; --ink: #1f2933; --soft: #5d6875;
        --own: #0072B2; --halo: #ffffff; --page: #f3f5f7; --unknown: #9aa3ad; --start: #0072B2; }
.body--dark { --cell: #20262d; --line: #2f3740; --wall: #56616d; --ink: #e8ecf0; --soft: #9aa7b4;
        --own: #6cbcf0; --halo: #14181c; --page: #14181c; --unknown: #7b8794; --start: #6cbcf0; }
body { background: var(--page); color: var(--ink); }
.nicegui-content { padding: 0; }
.frame { width: 100%; max-width: 1500px; margin: 0 auto; padding: 12px 16px 24px; gap: 12px; }
.columns { display: grid; width: 100%; gap: 12px; align-items: start;
           grid-template-columns: minmax(0, 1.15fr) minmax(0, 1fr); }
.side { width: 100%; gap: 12px; flex-wrap: nowrap; }
@media (max-width: 1000px) { .columns { grid-template-columns: minmax(0, 1fr); } }
.panel { width: 100%; gap: 8px; padding: 12px 14px; border-radius: 10px; box-shadow: none;
         border: 1px solid var(--line); background: var(--cell); flex-wrap: nowrap; }
.q-item.body--dark .q-btn.text-primary { color: #6cbcf0 !important; }
.body--dark .q-btn.text-negative { color: #ff8f78 !important; }
.panel-title { min-height: 0; }
.q-item.panel-title .q-item__label { white-space: nowrap; }
.panel-title { font-size: 0.78rem; font-weight: 600; letter-spacing: 0.05em; color: var(--soft);
               text-transform: uppercase; }
.soft { color: var(--soft); font-size: 0.85rem; }
.number { font-variant-numeric: tabular-nums; }
.grow { flex: 1 1 auto; min-width: 0; }
.world { width: 100%; max-width: min(100%, calc(var(--shape) * var(--tall))); margin: 0 auto;
         touch-action: none; user-select: none; }
.world svg { overflow: visible; }
.world.painting { cursor: crosshair; }
.lines { stroke: var(--line); stroke-width: 1; fill: none; }
.wall { fill: var(--wall); }
.goal { fill: var(--ink); }
.start { fill: var(--start); opacity: 0.22; }
.unknown { fill: var(--unknown); }
.own { fill: none; stroke: var(--own); stroke-width: 2.6; stroke-linecap: round;
       stroke-linejoin: round; }
.halo { fill: none; stroke: var(--halo); stroke-width: 5.4; stroke-linecap: round;
        stroke-linejoin: round; opacity: 0.75; }
.robot circle { fill: #6d3fc0; stroke: var(--halo); stroke-width: 2; }
.robot .eye { fill: #ffffff; stroke: none; }
.waits { fill: none; stroke: #6d3fc0; stroke-width: 3; animation: waits 0.8s infinite alternate; }
@keyframes waits { from { opacity: 0.15; } to { opacity: 1; } }
.alarm { width: 100%; padding: 8px 14px; border-radius: 10px; font-weight: 500;
         background: #fbe3dc; color: #8a1f09; }
.body--dark .alarm { background: #43190f; color: #ffb9a7; }
.scale { height: 8px; width: 110px; border-radius: 4px;
         background: linear-gradient(90deg, #cc3311, #e69f00, #009e73); }
.dot { width: 10px; height: 10px; border-radius: 50%; flex: none; background: var(--unknown); }
.dot.well { background: #009e73; } .dot.waiting { background: #e69f00; }
.dot.ill { background: #cc3311; }
.node { display: grid; grid-template-columns: 10px 7.2rem minmax(0, 1fr); gap: 10px;
        align-items: baseline; width: 100%; font-size: 0.88rem; }
.words { overflow-wrap: anywhere; color: var(--soft); }
.setting { display: grid; grid-template-columns: minmax(0, 1fr) 9.5rem; gap: 10px; width: 100%;
           align-items: center; }
.setting-name { font-size: 0.88rem; } .setting-text { font-size: 0.76rem; color: var(--soft); }
"""
