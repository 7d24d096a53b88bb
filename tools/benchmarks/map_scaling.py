# SPDX-License-Identifier: Apache-2.0
"""What grows with the size of the map, and what must not."""

from dataclasses import replace
import subprocess
import sys

from comply_ros.nodes.cost_throttle import TIMES
from comply_ros.world.mdp import World
from tools.benchmarks import planning_time
from tools.benchmarks.in_process import Lesson, ROWS
from tools.benchmarks.interleave import ratios, Row
from tools.benchmarks.processes import measure, nodes_file, real
from tools.benchmarks.sample_maps import room, write_advice, write_room

IN_PROCESS, OVER_TOPICS, SMALL = (11, 41, 201, 1001), (41, 201, 1001), (11, 41)
IN_CACHE = 201  # cells a side, up to which a step should not become dearer
FLAT, MAPS_GOAL, PLANNING_GOAL = 1.5, 2.0, 20.0
SHORT, SHORT_IF_LARGE = 20, 100  # steps of an episode where every episode brings maps
PATIENCE = 60.0  # seconds for value iteration, before it is estimated
NEVER, ALWAYS = 3600.0, 0.0  # least seconds between two maps
WITHOUT_END = 1_000_000  # episodes of an iteration: not even the first map is due


def measured(bench):
    """Return the rows of growth, and the raw figures."""
    inside, over = steps_in_process(bench), steps_over_topics(bench)
    maps, planned = seconds_of_maps(bench), seconds_to_plan(bench)
    rows = [*flat('in process', inside), *flat('over topics', over)]
    for side, seconds in maps.items():
        name = f'maps, {side} x {side}: % of the loop'
        rows.append(Row(f'{name}, if once a second', [100.0 * each for each in seconds]))
        rows.append(Row(f'{name}, as they come',
                        [100.0 * each / max(1.0, TIMES * each) for each in seconds], MAPS_GOAL,
                        at_least=False))
    rows += [Row(f'value iteration, {how}, seconds', seconds, PLANNING_GOAL, at_least=False)
             for how, seconds in planned.items()]
    return rows, {'seconds of a step in process': inside, 'seconds of a step over topics': over,
                  'seconds that the loop loses by a map': maps, 'seconds to plan': planned}


def flat(where, seconds):
    """Rows of `seconds[side][round]` of a step: against the smallest map, and absolute."""
    first = next(iter(seconds))
    for side, each in seconds.items():
        if side != first:
            yield Row(f'a step {where}, {side} x {side} / {first} x {first}',
                      ratios(each, seconds[first]), FLAT if side <= IN_CACHE else None,
                      at_least=False)
    for side, each in seconds.items():
        yield Row(f'a step {where}, {side} x {side}, nanoseconds', [1e9 * one for one in each])


def steps_in_process(bench):
    """Return the seconds of a step, `seconds[side][round]`."""
    endless = replace(ROWS['beta_implicit'], measuring_iterations=0, iterations=0)
    lessons = {side: Lesson('', World(room(side)), endless, advice(side, bench.folder))
               for side in (SMALL if bench.quick else IN_PROCESS)}
    for lesson in lessons.values():
        lesson.rate(0.01 if bench.quick else 1.0)  # the tables are touched for the first time
    rates = bench.interleave('growth in process', {
        side: lambda each=each: each.rate(0.01 if bench.quick else 0.5)
        for side, each in lessons.items()})
    return {side: [1.0 / rate for rate in each] for side, each in rates.items()}


def steps_over_topics(bench):
    """Return the seconds of a step without maps, `seconds[side][round]`."""
    def once(side, parameters):
        return lambda: 1.0 / measure(bench.folder / 'growth', real(), 0.3 if bench.quick else 3.0,
                                     parameters).rate
    return bench.interleave('growth over topics', {
        side: once(side, room_file(bench, side, map_period=NEVER, episodes=WITHOUT_END))
        for side in (SMALL if bench.quick else OVER_TOPICS)})


def seconds_of_maps(bench):
    """
    Return what the loop loses by one message on `trust` and one on `policy`, `[side][round]`.

    Of two loops in short episodes, one brings maps after each: the difference of the time of an
    episode.
    """
    found = {}
    for side in (SMALL if bench.quick else OVER_TOPICS):
        seconds = bench.interleave(f'maps, {side} x {side}', {
            period: lambda period=period, side=side: seconds_of_an_episode(bench, side, period)
            for period in (ALWAYS, NEVER)})
        found[side] = [with_maps - without for with_maps, without in zip(
            seconds[ALWAYS], seconds[NEVER], strict=True)]
    return found


def seconds_of_an_episode(bench, side, period):
    """Seconds of a short episode in a room, with at least that period between two maps."""
    large = side > IN_CACHE
    steps = SHORT_IF_LARGE if large else SHORT
    parameters = room_file(bench, side, steps, map_period=period, episodes=1)
    return steps / measure(bench.folder / 'growth', real('maps_at_any_cost'),
                           0.5 if bench.quick else 15.0 if large else 3.0, parameters).rate


def room_file(bench, side, step_limit=320, **learner):
    """Write map and parameters of a loop in a room; return the path of the parameters."""
    folder = bench.folder / '-'.join(map(str, (side, step_limit, *learner.values())))
    folder.mkdir(exist_ok=True)
    return nodes_file(folder, {'map': str(write_room(side, folder, step_limit))},
                      {'mentor': advice(side, folder)}, learner)


def advice(side, folder):
    """Name of a mentor in a room that is made at once (others plan first)."""
    return f'file:{write_advice(side, folder)}'


def seconds_to_plan(bench):
    """Return the seconds of value iteration in the largest room, by how they were found."""
    side = SMALL[-1] if bench.quick else IN_PROCESS[-1]
    name = f'{side} x {side}'

    def plan():
        try:
            done = subprocess.run([sys.executable, '-m', planning_time.__name__, str(side)],
                                  capture_output=True, text=True, check=True, timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            return None
        return float(done.stdout)
    seconds = bench.interleave('value iteration', {name: plan}, rounds=1)[name]
    if seconds[0] is not None:
        return {name: seconds}
    bench.notes.append(f'value iteration, {name}: not done within {PATIENCE:.0f} s, so estimated: '
                       'seconds of a sweep, times the sweeps of a room of '
                       f'{IN_CACHE} x {IN_CACHE} times the ratio of the sides')
    return {f'{name}, estimated': [planning_time.estimate(side, IN_CACHE, sweeps=3)]}
