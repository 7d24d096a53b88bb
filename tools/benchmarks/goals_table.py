# SPDX-License-Identifier: Apache-2.0
"""The table at the end: every row against its goal."""

from statistics import median

from rich.table import Table


def short(value):
    """Return a number with three digits that count, or more before the point."""
    return f'{value:,.0f}' if abs(value) >= 100 else f'{value:.3g}'


def table(sections):
    """`rich` table of `sections[name]`, lists of `Row`."""
    drawn = Table(box=None, padding=(0, 2, 0, 0))
    for name in ('', 'median', 'lowest', 'highest', 'goal', ''):
        drawn.add_column(name, justify='left' if not name else 'right')
    for section, rows in sections.items():
        drawn.add_row(f'[bold]{section}[/]')
        for row in rows:
            drawn.add_row(*cells(row))
    return drawn


def cells(row):
    """Texts of a row."""
    goal = '' if row.goal is None else f'{"≥" if row.at_least else "≤"} {short(row.goal)}'
    return (row.name, short(median(row.values)), short(min(row.values)), short(max(row.values)),
            goal, row.verdict())


def content(rows):
    """Rows as JSON has them."""
    return [{**row._asdict(), 'median': median(row.values), 'verdict': row.verdict()}
            for row in rows]
