# SPDX-License-Identifier: Apache-2.0
"""How long it takes until it learns, and how much memory it keeps."""

from contextlib import ExitStack
import os
from pathlib import Path
import subprocess
import time

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions

from comply_ros.nodes.node_processes import NodeProcess
from comply_ros.nodes.topics import ACTION
from tools.benchmarks.interleave import Row
from tools.benchmarks.processes import end, NODES, nodes_file, TOP, wait_until

READY_GOAL, MEMORY_GOAL, DEMO_GOAL = 1.0, 80.0, 3.0
DEMO = TOP / 'scripts' / 'demo'


def measured(bench):
    """Return the rows of start and size, and the raw figures."""
    looks = bench.interleave('start', {'nodes': lambda: start_nodes(bench)})['nodes']
    rows, figures = [], {'nodes': looks}
    for name in NODES:
        rows.append(Row(f'{name}: from start to ready, seconds',
                        [each[name]['ready'] for each in looks], READY_GOAL, at_least=False))
    for name in NODES:
        rows.append(Row(f'{name}: resident memory while it runs, MB',
                        [each[name]['memory'] for each in looks], MEMORY_GOAL, at_least=False))
    if DEMO.exists():
        demo(bench)  # the first start compiles and generates
        figures['demo'] = bench.interleave('demo', {'demo': lambda: demo(bench)})['demo']
        rows.append(Row('scripts/demo: from a second start to the first step, seconds',
                        figures['demo'], DEMO_GOAL, at_least=False))
    return rows, figures


def start_nodes(bench):
    """Return, for each node, the seconds to `ready` and its memory in a loop that is warm."""
    folder = bench.folder / 'start'
    folder.mkdir(exist_ok=True)
    arguments = ['--params-file', str(nodes_file(folder)), '-r', f'__ns:=/benchmark_{os.getpid()}']
    found = {}
    with ExitStack() as ends:
        started = {}
        for name in NODES:
            begin = time.perf_counter()
            node = started[name] = NodeProcess(name, arguments, folder)
            ends.callback(node.wait)
            ends.callback(node.interrupt)
            wait_until(lambda: b'ready' in node.log.read_bytes(), f'{name} ready', node.check)
            found[name] = {'ready': time.perf_counter() - begin}
        wait_until(lambda: b'begins to learn' in started['learner'].log.read_bytes(), 'a world')
        time.sleep(0.2 if bench.quick else 2.0)  # the loop runs meanwhile, and takes memory
        for name, node in started.items():
            found[name]['memory'] = memory(node.pid)
    return found


def memory(pid):
    """Resident memory of a process, in MB (of 1,000,000 bytes)."""
    status = Path(f'/proc/{pid}/status').read_text()
    kilobytes = next(line for line in status.splitlines() if line.startswith('VmRSS')).split()[1]
    return int(kilobytes) * 1024 / 1e6


def demo(bench):
    """Return the seconds from the start of `scripts/demo` to the first action of its learner."""
    heard = []
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    try:
        executor, node = SingleThreadedExecutor(), rclpy.create_node('benchmark')
        node.create_subscription(ACTION.message, ACTION.name, heard.append, ACTION.qos)
        executor.add_node(node)
        begin = time.perf_counter()
        with (bench.folder / 'demo.log').open('wb') as output:
            process = subprocess.Popen([str(DEMO), '--out', str(bench.folder / 'demo')],
                                       stdout=output, stderr=output, start_new_session=True)
        try:
            wait_until(lambda: executor.spin_once(timeout_sec=0.1) or heard, 'a step of the demo')
            return time.perf_counter() - begin
        finally:
            end(process)
    finally:
        rclpy.try_shutdown()


def set_up(bench):
    """Return the row of the whole set-up on a fresh clone, and the raw figure."""
    clone = bench.folder / 'clone'
    subprocess.run(['git', 'clone', '--quiet', '--no-hardlinks', str(TOP), str(clone)], check=True)
    fresh = {key: value for key, value in os.environ.items()
             if key in ('PATH', 'HOME', 'LANG') or key.startswith('PIP_')}

    def once():
        begin = time.perf_counter()
        subprocess.run([str(clone / 'scripts' / 'python'), '-c', ''], check=True, env=fresh,
                       capture_output=True)
        return time.perf_counter() - begin
    seconds = bench.interleave('set-up', {'set-up': once}, rounds=1)['set-up']
    return [Row('the whole set-up on a fresh clone, seconds', seconds)], {'set-up': seconds}
