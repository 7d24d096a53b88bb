# SPDX-License-Identifier: Apache-2.0
"""`scripts/benchmark`: everything side by side in one run, as a table and `benchmark.json`."""

import argparse
import json
from pathlib import Path
import sys
import tempfile

from rich.console import Console

from comply_ros.storage.kernel_cache import use_kernel_cache
from comply_ros.terminal.console import console, progress_bar
from comply_ros.terminal.training_options import guarded
from tools.benchmarks import in_process, map_scaling, profile, ros_loop, startup, variants
from tools.benchmarks.goals_table import content, table
from tools.benchmarks.interleave import Bench
from tools.benchmarks.machine import machine
from tools.benchmarks.processes import BenchmarkError

SECTIONS = {'loop': ros_loop.measured, 'choices': variants.measured, 'engine': in_process.measured,
            'growth': map_scaling.measured, 'start': startup.measured}
ASKED = {'setup': startup.set_up, 'where': profile.measured}  # not measured unless asked for
ROUNDS, WIDTH = 5, 120


def parser():
    """`ArgumentParser` of the command."""
    parser = argparse.ArgumentParser(
        'benchmark', description='Measure everything that is claimed to be fast, side by side.')
    add = parser.add_argument
    add('--only', nargs='+', metavar='SECTION', choices=[*SECTIONS, *ASKED],
        default=list(SECTIONS), help=f'some of {", ".join(SECTIONS)}; setup (a fresh clone, '
        'minutes) and where (a profile of the loop) only on demand')
    add('--rounds', type=int, default=ROUNDS, metavar='N', help='(default: %(default)s)')
    add('--quick', action='store_true',
        help='only show that everything works: the figures mean nothing')
    add('--out', default='runs/benchmark', metavar='DIR', help='(default: %(default)s)')
    return parser


def main(argv):
    """Run the command; return the exit code."""
    given = parser().parse_args(argv[1:])
    use_kernel_cache()
    return guarded('benchmark', (BenchmarkError,), lambda: run(given))


def run(given):
    """Measure, show the table, write `benchmark.json`; return the exit code."""
    if given.rounds < 1:
        raise BenchmarkError(f'rounds must be at least 1, got {given.rounds}')
    out = Path(given.out)
    out.mkdir(parents=True, exist_ok=True)
    here, rows, figures = machine(), {}, {}
    with tempfile.TemporaryDirectory() as folder, progress_bar() as bar:
        bench = Bench(given.rounds, given.quick, Path(folder), bar)
        for name in given.only:
            section, figures[name] = {**SECTIONS, **ASKED}[name](bench)
            rows[name] = list(section)
    path = out / 'benchmark.json'
    path.write_text(json.dumps({
        'machine': here, 'rounds': given.rounds, 'quick': given.quick, 'notes': bench.notes,
        'rows': {name: content(each) for name, each in rows.items()}, 'figures': figures},
        indent=1) + '\n')
    show(rows, bench.notes, path)
    return 0


def show(rows, notes, path):
    """Print the table, what was left out, and where the file is."""
    Console(highlight=False, width=None if sys.stdout.isatty() else WIDTH).print(table(rows))
    for note in notes:
        console.print(note, soft_wrap=True)
    console.print(f'\n  {path}', soft_wrap=True)


if __name__ == '__main__':
    sys.exit(main(sys.argv))
