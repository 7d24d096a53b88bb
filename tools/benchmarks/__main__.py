# SPDX-License-Identifier: Apache-2.0
"""`scripts/benchmark`: measure all sections, print a table, write `benchmark.json`."""

import argparse
from collections.abc import Sequence
import json
from pathlib import Path
import sys
import tempfile

from comply_ros.nodes.node_processes import NodeDied
from comply_ros.storage.kernel_cache import use_kernel_cache
from comply_ros.terminal.command_line import CommandParser, whole_number
from comply_ros.terminal.console import console, progress_bar
from comply_ros.terminal.standard_output import standard_output
from comply_ros.terminal.training_options import guarded
from tools.benchmarks import (
    in_process,
    learner_levels,
    map_scaling,
    model_steps,
    profile,
    robots,
    ros_loop,
    startup,
)
from tools.benchmarks.interleave import Bench, BenchmarkError
from tools.benchmarks.report import as_json, machine, result_table

SECTIONS = {'loop': ros_loop.measure_loop, 'choices': ros_loop.measure_choices,
            'engine': in_process.measure_engine, 'growth': map_scaling.measure_growth,
            'start': startup.measure_start}
ON_DEMAND = {'setup': startup.measure_setup, 'where': profile.measure_parts,
             'robots': robots.measure_robots, 'model': model_steps.measure_model,
             'levels': learner_levels.measure_levels}
ROUNDS = 5


def parser() -> argparse.ArgumentParser:
    """`ArgumentParser` of the command."""
    parser = CommandParser(
        'benchmark', description='Measure the speed of comply_ros side by side with others.')
    add = parser.add_argument
    add('--only', nargs='+', metavar='SECTION', choices=[*SECTIONS, *ON_DEMAND],
        default=list(SECTIONS), help=f'some of {", ".join(SECTIONS)}; on demand only: setup (of '
        'a fresh clone, minutes), where (a profile of the loop), robots (1 to 8 of them), '
        'model (steps of a learner with a model) and levels (of a learner, without ROS)')
    add('--rounds', type=whole_number, default=ROUNDS, metavar='N', help='(default: %(default)s)')
    add('--quick', action='store_true',
        help='show only that everything works: the numbers mean nothing')
    add('--out', default='runs/benchmark', metavar='DIR', help='(default: %(default)s)')
    return parser


def main(argv: Sequence[str]) -> int:
    """Run the command; return the exit code."""
    given = parser().parse_args(argv[1:])
    use_kernel_cache()
    return guarded('benchmark', (BenchmarkError, NodeDied), lambda: run(given))


def run(given: argparse.Namespace) -> int:
    """Measure the sections, show and write the result; return the exit code."""
    if given.rounds < 1:
        raise BenchmarkError(f'rounds must be at least 1, got {given.rounds}')
    out = Path(given.out)
    out.mkdir(parents=True, exist_ok=True)
    measured_on, rows, figures = machine(), {}, {}
    with tempfile.TemporaryDirectory() as folder, progress_bar() as bar:
        bench = Bench(given.rounds, given.quick, Path(folder), bar)
        for name in given.only:
            section, figures[name] = {**SECTIONS, **ON_DEMAND}[name](bench)
            rows[name] = list(section)
    path = out / 'benchmark.json'
    path.write_text(json.dumps({
        'machine': measured_on, 'rounds': given.rounds, 'quick': given.quick,
        'notes': bench.notes, 'rows': {name: as_json(each) for name, each in rows.items()},
        'figures': figures}, indent=1) + '\n')
    console.print(result_table(rows))
    for note in bench.notes:
        console.print(note, soft_wrap=True)
    console.print(f'\n  {path}', soft_wrap=True)
    return 0


if __name__ == '__main__':
    with standard_output():
        sys.exit(main(sys.argv))
