# SPDX-License-Identifier: Apache-2.0
"""The result of a benchmark: a table of rows against their goals, and the machine it ran on."""

from collections.abc import Iterable, Mapping
from datetime import date
from importlib.metadata import PackageNotFoundError, version
import os
from pathlib import Path
import platform
from statistics import median
from typing import Any

from rich.table import Table

from comply_ros import __version__
from comply_ros.experiments.available_cores import available_cores
from tools.benchmarks.interleave import Row

PACKAGES = {'numpy': 'numpy', 'numba': 'numba', 'rclpy': 'ros-rclpy', 'gymnasium': 'gymnasium',
            'mushroom_rl': 'mushroom-rl'}


def result_table(sections: Mapping[str, Iterable[Row]]) -> Table:
    """`rich` table of the rows of all sections."""
    table = Table(box=None, padding=(0, 2, 0, 0))
    for name in ('', 'median', 'lowest', 'highest', 'goal', ''):
        table.add_column(name, justify='left' if not name else 'right')
    for section, rows in sections.items():
        table.add_row(section, style='bold')
        for row in rows:
            table.add_row(*cells(row))
    return table


def cells(row: Row) -> tuple[str, ...]:
    """Texts of a row of the table."""
    goal = '' if row.goal is None else f'{"≥" if row.at_least else "≤"} {_short(row.goal)}'
    return (row.name, _short(median(row.values)), _short(min(row.values)),
            _short(max(row.values)), goal, row.verdict())


def _short(value: float) -> str:
    """Return a number with three significant digits, or with all digits before the point."""
    return f'{value:,.0f}' if abs(value) >= 100 else f'{value:.3g}'


def as_json(rows: Iterable[Row]) -> list[dict[str, Any]]:
    """Rows as they are written to `benchmark.json`."""
    return [{**row._asdict(), 'median': median(row.values), 'verdict': row.verdict()}
            for row in rows]


def machine() -> dict[str, Any]:
    """Processor, cores, versions and date; nothing that identifies the owner of the machine."""
    return {'date': date.today().isoformat(), 'processor': _processor(),
            'cores': available_cores(),
            'load at the start': round(os.getloadavg()[0], 1),
            'comply_ros': __version__, 'Python': platform.python_version(),
            **{name: _installed(package, name) for name, package in PACKAGES.items()}}


def _processor() -> str:
    for line in Path('/proc/cpuinfo').read_text().splitlines():
        if line.startswith('model name'):
            return line.partition(':')[2].strip()
    return platform.machine()


def _installed(*names: str) -> str | None:
    """Version of the first of these packages that is installed; None if none is."""
    for name in names:
        try:
            return version(name)
        except PackageNotFoundError:
            continue
    return None
