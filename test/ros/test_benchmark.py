# SPDX-License-Identifier: Apache-2.0
"""scripts/benchmark: its arithmetic worked by hand, its C loop, and every section once."""

import json
import os
from pathlib import Path
import signal
import socket
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest
from waiting import DEADLINE

from comply_ros.learner.presets import METHODS
from comply_ros.learner.training import Training
from comply_ros.mentor.policy_text import parse_policy
from comply_ros.storage.map_files import read_map
from comply_ros.world.mdp import World
from examples import SEARCH
from tools.benchmarks import c_loop, in_process, map_scaling, other_libraries
from tools.benchmarks.interleave import Bench, BenchmarkError, ratios, Row
from tools.benchmarks.map_scaling import room, write_advice, write_room
from tools.benchmarks.processes import measure, ROOT, wait_until
from tools.benchmarks.report import as_json, cells, machine
from tools.benchmarks.robots import (
    candidates,
    count_steps,
    Load,
    load_rows,
    processor_seconds,
    Robots,
)
from tools.benchmarks.step_times import loop_speed, StepTimes, TIMES_FILE, WARM_FILE

SECTIONS = {'loop': 11, 'choices': 4, 'engine': len(METHODS['published']) + 1, 'growth': 9,
            'start': 6, 'where': 55, 'robots': 12,
            'model': 8, 'levels': 7}  # rows that there are at least


class NoBar:
    """A progress bar that shows nothing."""

    def add_task(self, *_, **__):
        """Do nothing."""

    update = advance = add_task


@pytest.fixture
def bench(tmp_path):
    """Return a `Bench` of three rounds."""
    return Bench(3, True, tmp_path, NoBar())


@pytest.fixture(scope='module')
def maze():
    """Return the `World` of the maze."""
    return World(read_map('maze', 'published'))


def test_every_other_round_goes_backwards(bench):
    order = []
    candidates = {name: lambda name=name: order.append(name) or len(order) for name in 'abc'}
    assert bench.interleave('letters', candidates) == {
        'a': [1, 6, 7], 'b': [2, 5, 8], 'c': [3, 4, 9]}
    assert order == list('abccbaabc')


def test_ctrl_c_ends_the_benchmark_and_the_nodes_that_it_started(tmp_path, domain):
    process = subprocess.Popen(
        [sys.executable, '-m', 'tools.benchmarks', '--only', 'loop', '--out', str(tmp_path)],
        cwd=ROOT, stderr=subprocess.PIPE, text=True)
    children = Path(f'/proc/{process.pid}/task/{process.pid}/children')
    wait_until(lambda: len(children.read_text().split()) == 3, 'process of the ring')
    started = children.read_text().split()
    process.send_signal(signal.SIGINT)
    assert process.communicate(timeout=DEADLINE)[1].endswith('benchmark: interrupted\n')
    assert process.returncode == 130
    wait_until(lambda: not any(Path(f'/proc/{pid}').exists() for pid in started), 'end of all')


def test_the_load_of_several_robots_is_that_of_all_in_the_same_time():
    rows = list(load_rows({Robots(1): [Load(2000.0, 1.5, 210.0)],
                           Robots(2, True): [Load(3000.0, 1.8, 350.0)]}))
    assert [(row.name, row.values) for row in rows] == [
        ('one robot: steps per second in all', [2000.0]),
        ('one robot: processors in use', [1.5]),
        ('one robot: processor time of a step, microseconds', [750.0]),
        ('one robot: memory, MB', [210.0]),
        ('2 robots, one mentor: steps per second in all', [3000.0]),
        ('2 robots, one mentor: processors in use', [1.8]),
        ('2 robots, one mentor: processor time of a step, microseconds', [600.0]),
        ('2 robots, one mentor: memory, MB', [350.0])]
    assert candidates([1, 2]) == [Robots(1), Robots(2), Robots(2, True)]
    times = np.array([-10, 20, 30, 40, -50, 60])  # two starts of an episode, and four steps
    assert count_steps(times, 20, 60) == 3


def test_processor_time_is_that_of_a_process_with_its_threads():
    before = processor_seconds([os.getpid()])
    while processor_seconds([os.getpid()]) < before + 0.05:
        sum(range(10_000))
    used = sum(os.times()[:2])
    assert abs(processor_seconds([os.getpid()]) - used) < 0.05


def test_candidates_that_are_numbers_are_shown_as_text(tmp_path):
    shown = []
    bar = SimpleNamespace(add_task=lambda *_, **fields: 0, advance=lambda task: None,
                          update=lambda task, now: shown.append(now))
    Bench(1, True, tmp_path, bar).interleave('sizes', {41: lambda: 1.0, 201: lambda: 2.0})
    assert shown == ['41', '201', '']


def test_ratios_are_of_the_same_round():
    assert ratios([2.0, 9.0, 4.0], [1.0, 3.0, 8.0]) == [2.0, 3.0, 0.5]
    with pytest.raises(ValueError, match='shorter'):
        ratios([1.0, 2.0], [1.0])


@pytest.mark.parametrize('values, goal, at_least, verdict', [
    ([0.5, 0.9, 0.85], 0.85, True, 'met'),  # the median is 0.85
    ([0.5, 0.9, 0.8], 1.0, True, 'missed by 20%'),
    ([1.0, 3.0, 9.0], 2.0, False, 'missed by 50%'),
    ([1.0, 2.0, 9.0], 2.0, False, 'met'),
    ([1.0], None, True, '')])
def test_a_goal_is_for_the_median(values, goal, at_least, verdict):
    assert Row('a row', values, goal, at_least).verdict() == verdict


def test_a_row_shows_median_range_goal_and_verdict():
    row = Row('seconds', [12345.6, 0.01234, 2.0], 1.0, at_least=False)
    assert cells(row) == ('seconds', '2', '0.0123', '12,346', '≤ 1', 'missed by 100%')
    assert as_json([row])[0]['median'] == 2.0


def test_the_speed_of_a_loop_worked_by_hand():
    times = np.array([1, 3, -6, 8, 12, 21]) * 1_000_000  # milliseconds; at 6 an episode starts
    speed = loop_speed(times)
    assert speed.rate == 4 / 0.020  # the first step only starts the clock
    assert speed.episodes == 1
    assert speed.median == 3000.0  # of 2, 3, 2, 4 and 9 milliseconds
    assert speed.percentile_99 == pytest.approx(8800.0)  # 0.96 of the way from 4 to 9
    with pytest.raises(ValueError, match='at least 2 steps, got 0'):
        loop_speed(np.array([], dtype=np.int64))


def test_steps_before_the_loop_is_warm_do_not_count(tmp_path):
    times = StepTimes(tmp_path, warm_up=2)
    times.record()
    assert not (tmp_path / WARM_FILE).exists()
    for is_start in (False, False, True):
        times.record(is_start)
    assert (tmp_path / WARM_FILE).exists()
    times.write()
    written = np.fromfile(tmp_path / TIMES_FILE, dtype=np.int64)
    assert (written > 0).tolist() == [True, False]


def test_the_c_loop_learns_what_ours_learns(maze, tmp_path):
    config = METHODS['published']['sarsa']
    steps, seconds, returns = c_loop.CLoop(maze, config, tmp_path).learn(seed=3)
    training = Training(maze, np.full(len(maze.free), -1), config, 3)
    ours = [training.iterate().mean_return for _ in range(config.iterations)]
    assert returns[0] == pytest.approx(ours[0], abs=15.0)  # both start badly: about -70
    assert np.mean(returns[-50:]) == pytest.approx(np.mean(ours[-50:]), abs=0.5)
    assert np.mean(returns[-50:]) > 4.5
    assert steps > config.iterations * config.episodes * 40  # no way to the goal is shorter
    assert seconds > 0.0


def test_the_c_loop_rejects_a_method_that_it_cannot_learn(maze, tmp_path):
    with pytest.raises(BenchmarkError, match='only learn plain SARSA'):
        c_loop.CLoop(maze, METHODS['published']['sarsa_lambda'], tmp_path)


def test_c_code_that_does_not_compile_is_an_error(maze, tmp_path, monkeypatch):
    monkeypatch.setattr(c_loop, 'SOURCE', tmp_path / 'wrong.c')
    (tmp_path / 'wrong.c').write_text('int learn(\n')
    with pytest.raises(BenchmarkError, match='cc -O3 -fPIC -shared must compile wrong.c: .*error'):
        c_loop.CLoop(maze, METHODS['published']['sarsa'], tmp_path)


def test_a_library_that_is_missing_is_left_out_and_named_with_the_remedy(bench, monkeypatch):
    monkeypatch.setitem(sys.modules, 'gymnasium', None)
    monkeypatch.setitem(sys.modules, 'mushroom_rl', None)
    monkeypatch.setattr(in_process, 'compiler', lambda: None)
    assert list(in_process.available_programs(bench)) == []
    assert [note.partition(':')[0] for note in bench.notes] == [
        'C, -O3', 'Gymnasium and numpy', 'MushroomRL']
    for note in bench.notes[1:]:
        assert note.endswith(': scripts/python -m pip install --no-deps -r '
                             'requirements/benchmark.txt')
    assert (ROOT / 'requirements' / 'benchmark.txt').exists()


def test_the_plain_world_moves_as_the_world_does(maze):
    plain_world, s, slipped = other_libraries.PlainWorld(maze, 0), int(maze.starts[0]), 0
    assert plain_world.reset() in maze.starts.tolist()
    for _ in range(2000):
        reward, s2, done = plain_world.step(s, 1)
        slipped += s2 != maze.successor[s, 1]
        assert any(maze.successor[s, b] == s2 and maze.reward[s, b] == reward for b in range(4))
        assert done == maze.terminal[s2]
    assert slipped / 2000 == pytest.approx(0.05, abs=0.02)


@pytest.mark.parametrize('name', ['NumpyLoop', 'Mushroom'])
def test_a_library_that_is_installed_takes_steps(maze, name):
    pytest.importorskip('gymnasium' if name == 'NumpyLoop' else 'mushroom_rl')
    assert getattr(other_libraries, name)(maze, METHODS['published']['sarsa']).rate(0.05) > 100.0


def test_a_room_is_the_same_when_it_is_read_from_a_file(tmp_path):
    assert read_map(str(write_room(7, tmp_path)), 'published') == room(7)
    assert len(room(201).starts) == pytest.approx(100, abs=1)


def test_the_advice_in_a_room_leads_to_its_goal(tmp_path):
    world, s, steps = World(room(7)), 0, 0
    policy = parse_policy(write_advice(7, tmp_path).read_text(), world)
    while not world.terminal[s]:
        s, steps = int(world.successor[s, policy[s]]), steps + 1
    assert steps == 12


def test_steps_are_compared_with_the_smallest_map():
    rows = list(map_scaling.step_rows('in process', {11: [0.25, 4.0], 201: [0.375, 8.0],
                                                     1001: [1.0, 9.0]}))
    assert [(row.name, row.values, row.goal) for row in rows[:2]] == [
        ('a step in process, 201 x 201 / 11 x 11', [1.5, 2.0], 1.5),
        ('a step in process, 1001 x 1001 / 11 x 11', [4.0, 2.25], None)]  # out of the cache
    assert rows[2].values == [0.25e9, 4e9]


def test_value_iteration_that_takes_too_long_is_estimated(bench, monkeypatch):
    monkeypatch.setattr(map_scaling, 'PLANNING_TIMEOUT', 0.001)
    monkeypatch.setattr(map_scaling, 'IN_CACHE', 11)
    (name, seconds), = map_scaling.seconds_of_planning(bench).items()
    assert name == '41 x 41, estimated'
    assert 0.001 < seconds[0] < 20.0
    assert 'not done within' in bench.notes[0]


def test_a_loop_that_does_not_start_is_an_error_with_its_output(bench, domain):
    with pytest.raises(BenchmarkError, match='(?s)process 0 of the loop ended with 1: .*KeyError'):
        measure(bench.folder / 'loop', [('empty_ring', 'nobody')], 0.1)


def test_the_description_of_the_machine_does_not_identify_its_owner():
    described = machine()
    assert {'date', 'processor', 'cores', 'Python', 'numpy', 'numba', 'rclpy'} <= set(described)
    assert described['numpy'] == np.__version__
    text = json.dumps(described)
    assert socket.gethostname() not in text
    assert str(Path.home()) not in text


def benchmark(*arguments):
    """Run the command; return it with `returncode`, `stdout` and `stderr`."""
    return subprocess.run([sys.executable, '-m', 'tools.benchmarks', *arguments], cwd=ROOT,
                          capture_output=True, text=True, check=False, timeout=2 * DEADLINE,
                          env={**os.environ, 'COLUMNS': '200'})  # pytest says 80


# The others take longest: `scripts/test search` measures them too.
@pytest.mark.parametrize('section', SECTIONS if SEARCH else ['loop', 'start'])
@pytest.mark.long
def test_every_section_is_measured_shown_and_written(section, tmp_path, domain):
    done = benchmark('--quick', '--rounds', '1', '--only', section, '--out', str(tmp_path))
    assert done.returncode == 0, done.stderr
    content = json.loads((tmp_path / 'benchmark.json').read_text())
    assert (content['rounds'], content['quick']) == (1, True)
    rows = content['rows'][section]
    assert len(rows) >= SECTIONS[section]
    assert set(content['figures']) == {section}
    for row in rows:
        assert all(isinstance(value, float) for value in row['values'])
        assert len(row['values']) == 1
        assert (row['goal'] is None) == (row['verdict'] == '')
        assert row['name'] in done.stdout
    assert str(tmp_path) not in json.dumps(content)


def test_a_wrong_number_of_rounds_is_one_line(tmp_path):
    done = benchmark('--rounds', '0', '--out', str(tmp_path))
    assert (done.returncode, done.stderr) == (
        2, 'benchmark: rounds must be at least 1, got 0\n')


def test_the_script_starts_the_command():
    text = (ROOT / 'scripts' / 'benchmark').read_text()
    assert text.startswith('#!/usr/bin/env bash\n# SPDX-License-Identifier: Apache-2.0\n')
    assert text.endswith('\nstart_tool benchmarks "$@"\n')
