# SPDX-License-Identifier: Apache-2.0
"""What a step of a learner with a model costs: in plain Python and in machine code."""

from collections.abc import Callable
from dataclasses import replace
import json
from pathlib import Path
from statistics import median
from time import sleep, thread_time_ns
from typing import Any

from comply_ros.experiments.stepped_training import SteppedTraining
from comply_ros.learner.presets import METHODS
from comply_ros.learner.step_kernels import PLAIN
from comply_ros.mentor.advice_budget import AdviceBudget
from comply_ros.protocol.world_moves import ModelMoves
from comply_ros.storage.map_files import read_map
from comply_ros.storage.mentor_cache import mentor_policy, read_mentor_spec
from comply_ros.world.mdp import World
from tools.benchmarks.in_process import MAP, MENTOR, PROFILE
from tools.benchmarks.instrumented_nodes import PLAIN_STEPS, REACTION
from tools.benchmarks.interleave import Bench, Row
from tools.benchmarks.processes import (
    NODES,
    ROOT,
    running,
    three_processes,
    wait_until,
    wait_until_warm,
    write_parameters,
)
from tools.soak import process_memory

METHOD, INTENDED = 'model_based', (0.95, 0.5)
GOAL, MEMORY_GOAL = 60.0, 150.0  # microseconds, MB
KINDS = {'plain Python': True, 'machine code': False}


def measure_model(bench: Bench) -> tuple[list[Row], dict[str, list[dict[str, float]]]]:
    """Rows of the section `model`, and what they come from: microseconds and MB."""
    path = write_slippery_map(bench.folder / 'maze.yaml', INTENDED[1])
    loops = {f'learner, {name}': lambda plain=plain: measure_node(bench, path, plain)
             for name, plain in KINDS.items()}
    steps: dict[str, Callable[[], dict[str, float]]] = {
        f'intended {intended}, {name}': lambda intended=intended, plain=plain: {
            'a step in process, microseconds': time_steps(bench, intended, plain)}
        for intended in INTENDED for name, plain in KINDS.items()}
    figures = bench.interleave('model', {**steps, **loops})
    goals = {'microseconds': GOAL, 'MB': MEMORY_GOAL}
    return [Row(f'{name}: {label}', [each[label] for each in rounds],
                goals[label.rpartition(' ')[2]], at_least=False)
            for name, rounds in figures.items() for label in rounds[0]], figures


def write_slippery_map(path: Path, intended: float) -> Path:
    """Write the maze with another chance that an action does what is intended; return its path."""
    text = (ROOT / 'comply_ros' / 'maps' / f'{MAP}.yaml').read_text()
    path.write_text(text.replace(f'intended: {INTENDED[0]}', f'intended: {intended}'))
    return path


def time_steps(bench: Bench, intended: float, plain: bool) -> float:
    """Return the median of `Agent.step`, in microseconds of processor time."""
    world = World(replace(read_map(MAP, PROFILE), intended=intended))
    mentor = AdviceBudget(world, mentor_policy(read_mentor_spec(MENTOR), world, 0))
    training = SteppedTraining(world, ModelMoves(world, 3), mentor, METHODS[PROFILE][METHOD], 3)
    agent, times = training.agent, list[int]()
    if plain:
        agent.use_kernels(PLAIN)
    step = agent.step

    def timed_step(*arguments: Any) -> Any:
        start = thread_time_ns()
        decision = step(*arguments)
        times.append(thread_time_ns() - start)
        return decision
    setattr(agent, 'step', timed_step)
    for _ in range(1 if bench.quick else 3):
        training.iterate()
    return median(times) / 1e3


def measure_node(bench: Bench, path: Path, plain: bool) -> dict[str, float]:
    """Return the reaction time and the memory of a learner's node, once its code is loaded."""
    folder = bench.folder / 'model'
    variants = (REACTION, PLAIN_STEPS) if plain else (REACTION,)
    parameters = write_parameters(bench.folder / 'nodes', {'map': str(path)}, None,
                                  {'method': METHOD})
    log = folder / f'{NODES.index("learner")}.log'
    with running(folder, three_processes(*variants), parameters) as processes:
        wait_until_warm(folder, processes)
        if not plain:
            wait_until(lambda: b'in machine code' in log.read_bytes(), 'machine code')
        sleep(0.5 if bench.quick else 10.0)  # the loop runs meanwhile
        memory = process_memory(processes[-1].pid)
    nanoseconds, = json.loads((folder / 'learner.json').read_text()).values()
    return {'from a message received to `publish`, microseconds': nanoseconds / 1e3,
            'memory, MB': memory}
