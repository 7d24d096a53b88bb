# SPDX-License-Identifier: Apache-2.0
"""Seconds until a node is ready, until the demo learns, and of a set-up; memory of the nodes."""

import os
import shutil
import subprocess
import time
from typing import Any

from comply_ros.nodes.node_processes import ended_with_block, NodeProcess
from tools.benchmarks.interleave import Bench, Row
from tools.benchmarks.processes import end, NODES, ROOT, wait_until, write_parameters
from tools.soak import process_memory

READY_GOAL, MEMORY_GOAL, DEMO_GOAL = 1.0, 80.0, 2.0
DEMO = ROOT / 'scripts' / 'demo'


def measure_start(bench: Bench) -> tuple[list[Row], dict[str, Any]]:
    """Rows of the section `start`, and what they come from: seconds and MB."""
    starts = bench.interleave('start', {'nodes': lambda: start_nodes(bench)})['nodes']
    figures: dict[str, Any] = {'nodes': starts}
    rows = [Row(f'{name}: {title}', [each[name][key] for each in starts], goal, at_least=False)
            for key, title, goal in (
                ('ready', 'from start to ready, seconds', READY_GOAL),
                ('memory', 'memory while it runs, MB', MEMORY_GOAL)) for name in NODES]
    if DEMO.exists():
        start_demo(bench)  # the first start compiles kernels and generates the mentor
        figures['demo'] = bench.interleave('demo', {'demo': lambda: start_demo(bench)})['demo']
        rows.append(Row('scripts/demo: from a second start to the first step, seconds',
                        figures['demo'], DEMO_GOAL, at_least=False))
    return rows, figures


def start_nodes(bench: Bench) -> dict[str, dict[str, float]]:
    """Return for each node the seconds to `ready`, and its memory in a running loop."""
    folder = bench.folder / 'start'
    parameters = write_parameters(folder)
    arguments = ['--params-file', str(parameters), '-r', f'__ns:=/benchmark_{os.getpid()}']
    found: dict[str, dict[str, float]] = {}
    with ended_with_block() as started:
        for name in NODES:
            start = time.perf_counter()
            node = NodeProcess(name, arguments, folder)
            started.append(node)
            wait_until(lambda: b'ready' in node.log.read_bytes(), f'a {name} that is ready',
                       node.check)
            found[name] = {'ready': time.perf_counter() - start}
        learner = started[-1]
        wait_until(lambda: b'starts to learn' in learner.log.read_bytes(),
                   'a learner that starts to learn', learner.check)
        time.sleep(0.2 if bench.quick else 2.0)  # the loop runs meanwhile, and takes memory
        for node in started:
            found[node.name]['memory'] = process_memory(node.pid)
    return found


def start_demo(bench: Bench) -> float:
    """
    Return the seconds from the start of `scripts/demo` until its learner starts to learn.

    Its log tells: a subscriber of the benchmark would find the nodes up to two seconds later.
    """
    out = bench.folder / 'demo'
    shutil.rmtree(out, ignore_errors=True)
    log = out / 'learner.log'
    start = time.perf_counter()
    with (bench.folder / 'demo.log').open('wb') as output:
        process = subprocess.Popen([str(DEMO), '--out', str(out)], stdout=output, stderr=output,
                                   start_new_session=True)
    try:
        wait_until(lambda: log.exists() and b'starts to learn' in log.read_bytes(),
                   'a step of the demo')
        return time.perf_counter() - start
    finally:
        end(process)


def measure_setup(bench: Bench) -> tuple[list[Row], dict[str, Any]]:
    """Row of the section `setup`: the whole set-up of a fresh clone."""
    clone = bench.folder / 'clone'
    subprocess.run(['git', 'clone', '--quiet', '--no-hardlinks', str(ROOT), str(clone)],
                   check=True)
    environment = {key: value for key, value in os.environ.items()
                   if key in ('PATH', 'HOME', 'LANG') or key.startswith('PIP_')}

    def set_up() -> float:
        start = time.perf_counter()
        subprocess.run([str(clone / 'scripts' / 'python'), '-c', ''], check=True,
                       env=environment, capture_output=True)
        return time.perf_counter() - start
    seconds = bench.interleave('set-up', {'set-up': set_up}, rounds=1)['set-up']
    return [Row('the whole set-up on a fresh clone, seconds', seconds)], {'set-up': seconds}
