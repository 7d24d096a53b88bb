# SPDX-License-Identifier: Apache-2.0
"""Time of planning and of a step over topics for maps of growing size."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
import subprocess
import sys
import time
from typing import Any

import yaml

from comply_ros.nodes.publish_throttle import TIMES
from comply_ros.world.grid import Grid
from comply_ros.world.mdp import World
from comply_ros.world.planning import optimal_values, TOLERANCE, value_iteration
from tools.benchmarks.in_process import ROWS, TimedTraining
from tools.benchmarks.interleave import Bench, ratios, Row
from tools.benchmarks.processes import measure, three_processes, write_parameters

# Cells along a side of the maps, which are empty rooms.
IN_PROCESS, OVER_TOPICS, QUICK = (11, 41, 201, 1001), (41, 201, 1001), (11, 41)
IN_CACHE = 201  # up to this side a step must not become slower
STARTS = 100  # at most
STEP_LIMIT = 320
STEP_GOAL, MAPS_GOAL, PLANNING_GOAL = 1.5, 2.0, 20.0
SHORT_EPISODE, SHORT_EPISODE_IF_LARGE = 20, 100  # steps, where maps follow each episode
PLANNING_TIMEOUT = 60.0  # seconds of value iteration, after which it is estimated
NEVER, ALWAYS = 3600.0, 0.0  # values of map_period
ENDLESS = 1_000_000  # episodes in an iteration: not even the first maps are published


def measure_growth(bench: Bench) -> tuple[list[Row], dict[str, Any]]:
    """Rows of the section `growth`, and the seconds that they come from."""
    in_process, over_topics = seconds_of_steps(bench), seconds_of_steps_over_topics(bench)
    maps, planning = seconds_of_maps(bench), seconds_of_planning(bench)
    rows = [*step_rows('in process', in_process), *step_rows('over topics', over_topics)]
    for side, seconds in maps.items():
        name = f'maps, {side} x {side}: % of the loop'
        rows.append(Row(f'{name}, if once a second', [100.0 * each for each in seconds]))
        rows.append(Row(f'{name}, as they come',
                        [100.0 * each / max(1.0, TIMES * each) for each in seconds], MAPS_GOAL,
                        at_least=False))
    rows += [Row(f'value iteration, {name}, seconds', seconds, PLANNING_GOAL, at_least=False)
             for name, seconds in planning.items()]
    return rows, {
        'seconds of a step in process': in_process, 'seconds of a step over topics': over_topics,
        'seconds that the loop loses by a map': maps, 'seconds to plan': planning}


def step_rows(where: str, seconds: Mapping[int, Sequence[float]]) -> Iterator[Row]:
    """Rows of `seconds[side][round]` of a step: against the smallest map, and absolute."""
    first = next(iter(seconds))
    for side, each in seconds.items():
        if side != first:
            yield Row(f'a step {where}, {side} x {side} / {first} x {first}',
                      ratios(each, seconds[first]), STEP_GOAL if side <= IN_CACHE else None,
                      at_least=False)
    for side, each in seconds.items():
        yield Row(f'a step {where}, {side} x {side}, nanoseconds', [1e9 * one for one in each])


def seconds_of_steps(bench: Bench) -> dict[int, list[float]]:
    """Seconds of a step in process, `seconds[side][round]`."""
    endless = replace(ROWS['beta_implicit'], measuring_iterations=0, iterations=0)
    trainings = {side: TimedTraining('', World(room(side)), endless, advice(side, bench.folder))
                 for side in (QUICK if bench.quick else IN_PROCESS)}
    for training in trainings.values():
        training.rate(0.01 if bench.quick else 1.0)  # the tables are touched for the first time
    rates = bench.interleave('growth in process', {
        side: lambda each=each: each.rate(0.01 if bench.quick else 0.5)
        for side, each in trainings.items()})
    return {side: [1.0 / rate for rate in each] for side, each in rates.items()}


def seconds_of_steps_over_topics(bench: Bench) -> dict[int, list[float]]:
    """Seconds of a step over topics without maps, `seconds[side][round]`."""
    def seconds_in(side: int) -> Callable[[], float]:
        parameters = room_parameters(bench, side, map_period=NEVER, episodes=ENDLESS)
        return lambda: 1.0 / measure(bench.folder / 'growth', three_processes(),
                                     0.3 if bench.quick else 3.0, parameters).rate
    return bench.interleave('growth over topics', {
        side: seconds_in(side) for side in (QUICK if bench.quick else OVER_TOPICS)})


def seconds_of_maps(bench: Bench) -> dict[int, list[float]]:
    """
    Seconds that the loop loses by one message on each topic of maps, `seconds[side][round]`.

    Of two loops with short episodes, one publishes maps after each episode: the difference
    between the times of an episode.
    """
    found = {}
    for side in (QUICK if bench.quick else OVER_TOPICS):
        seconds = bench.interleave(f'maps, {side} x {side}', {
            period: lambda period=period, side=side: seconds_of_an_episode(bench, side, period)
            for period in (ALWAYS, NEVER)})
        found[side] = [with_maps - without for with_maps, without in zip(
            seconds[ALWAYS], seconds[NEVER], strict=True)]
    return found


def seconds_of_an_episode(bench: Bench, side: int, map_period: float) -> float:
    """Seconds of a short episode in a room."""
    large = side > IN_CACHE
    steps = SHORT_EPISODE_IF_LARGE if large else SHORT_EPISODE
    parameters = room_parameters(bench, side, steps, map_period=map_period, episodes=1)
    return steps / measure(bench.folder / 'growth', three_processes('unthrottled_maps'),
                           0.5 if bench.quick else 15.0 if large else 3.0, parameters).rate


def seconds_of_planning(bench: Bench) -> dict[str, list[float]]:
    """Seconds of value iteration in the largest room, by its name; estimated after a minute."""
    side = QUICK[-1] if bench.quick else IN_PROCESS[-1]
    name = f'{side} x {side}'

    def plan() -> float | None:
        code = f'from {__name__} import plan_room; print(plan_room({side}))'
        try:
            done = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True,
                                  check=True, timeout=PLANNING_TIMEOUT)
        except subprocess.TimeoutExpired:
            return None
        return float(done.stdout)
    seconds, = bench.interleave('value iteration', {name: plan}, rounds=1)[name]
    if seconds is not None:
        return {name: [seconds]}
    bench.notes.append(f'value iteration, {name}: not done within {PLANNING_TIMEOUT:.0f} s, so '
                       'estimated: seconds of a sweep, times the sweeps of a room of '
                       f'{IN_CACHE} x {IN_CACHE}, times the ratio of the sides')
    return {f'{name}, estimated': [estimate_planning(side, IN_CACHE, sweeps=3)]}


def plan_room(side: int) -> float:
    """Seconds of value iteration in a room."""
    world = World(room(side))
    start = time.perf_counter()
    optimal_values(world)
    return time.perf_counter() - start


def estimate_planning(side: int, smaller: int, sweeps: int) -> float:
    """
    Estimate the seconds of value iteration in a room from the time of a few sweeps.

    The number of sweeps grows with the side of a room, and is counted in a smaller one.
    """
    needed = next(number for number, (_, change) in enumerate(
        value_iteration(World(room(smaller))), 1) if change < TOLERANCE) * side / smaller
    iteration = value_iteration(World(room(side)))
    next(iteration)
    start = time.perf_counter()
    for _ in range(sweeps):
        next(iteration)
    return needed * (time.perf_counter() - start) / sweeps


def room(side: int, step_limit: int = STEP_LIMIT) -> Grid:
    """`Grid` of side x side free cells, the goal in a corner, starts spread over all of it."""
    cells = side * side
    rows = ('.' * (side - 1) + 'G', *('.' * side for _ in range(side - 1)))
    return Grid(rows=rows, starts=tuple(range(0, cells - 1, max(1, cells // STARTS))),
                step_reward=-0.1, obstacle_reward=-0.1, goal_reward=1.0, intended=0.9,
                step_limit=step_limit)


def write_room(side: int, folder: Path, step_limit: int = STEP_LIMIT) -> Path:
    """Write the map of a room; return its path."""
    grid, path = room(side, step_limit), folder / f'room_{side}.yaml'
    path.write_text(yaml.safe_dump({
        'intended': grid.intended, 'step_limit': grid.step_limit,
        'rewards': {'step': grid.step_reward, 'goal': grid.goal_reward},
        'starts': [list(grid.place(s)) for s in grid.starts], 'rows': list(grid.rows)},
        default_flow_style=None, width=10 ** 9))
    return path


def write_advice(side: int, folder: Path) -> Path:
    """Write a policy for a room: right, and up in the last column; return its path."""
    path = folder / f'advice_{side}.txt'
    path.write_text('>' * (side - 1) + 'G\n' + ('>' * (side - 1) + '^\n') * (side - 1))
    return path


def advice(side: int, folder: Path) -> str:
    """Name of a mentor in a room that needs no planning."""
    return f'file:{write_advice(side, folder)}'


def room_parameters(bench: Bench, side: int, step_limit: int = STEP_LIMIT,
                    **learner: float) -> Path:
    """Write the map and the parameters of a loop in a room; return the path of the parameters."""
    folder = bench.folder / '-'.join(map(str, (side, step_limit, *learner.values())))
    folder.mkdir(exist_ok=True)
    return write_parameters(folder, {'map': str(write_room(side, folder, step_limit))},
                            {'mentor': advice(side, folder)}, learner)
