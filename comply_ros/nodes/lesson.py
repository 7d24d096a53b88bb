# SPDX-License-Identifier: Apache-2.0
"""`lesson`: the three nodes as processes, started, watched, and ended with their results."""

from contextlib import contextmanager, nullcontext
import fcntl
import os
from pathlib import Path
import re
import shutil
import sys
import tempfile
import time

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions
import yaml

from comply_ros.learner.learner_config import CONFIG_FIELDS, ConfigError
from comply_ros.nodes.node_processes import NodeDied, NodeProcess
from comply_ros.nodes.parameters import FASTEST, SLOWEST
from comply_ros.nodes.run_monitor import LessonFailed, RunMonitor, TAKEN
from comply_ros.nodes.topics import ANOTHER
from comply_ros.terminal.console import iteration_status, progress_bar
from comply_ros.terminal.interrupts import check, interrupts
from comply_ros.terminal.run_report import report_training
from comply_ros.terminal.training_options import main_with, training_parser
from comply_ros.world.mdp import World
from comply_ros.world.planning import ReferenceReturns

NODES = ('grid_world', 'mentor', 'learner')
LOOK = 0.1  # seconds between looks at whether the nodes live
STATE = 'state'  # folder beside the results where the nodes of `--respawn` keep theirs
SAVING = 10.0  # seconds after which a learner that does not answer is asked again to save
DISCOVERY = 1.0  # seconds in which others on the same topics are found


def parameters(options):
    """Parameters of the three nodes, as a table for a parameter file."""
    row = {name: getattr(options.config, name) for name in CONFIG_FIELDS}
    common = {'profile': options.profile, 'seed': options.seed}
    keeps = {'state_dir': str((options.out / STATE).resolve())} if options.args.respawn else {}
    return {
        'grid_world': {'map': _absolute(options.map_name), **common, **keeps},
        'mentor': {'mentor': _absolute_mentor(options), 'seed': options.mentor_seed,
                   'budget': options.budget, 'advising': options.advising, **keeps},
        'learner': {'method': options.method, **common, **row, **keeps,
                    'remembers_advice': not (options.budget and options.advising == 'mistakes')}}


def write_parameters(options):
    """Write the parameter file of the lesson and return its path."""
    path = options.out / 'parameters.yaml'
    table = {f'/**/{name}': {'ros__parameters': values}
             for name, values in parameters(options).items()}
    path.write_text('# What this lesson was run with: --ros-args --params-file parameters.yaml\n'
                    + yaml.safe_dump(table, sort_keys=False))
    return path


def _absolute(name):
    return str(Path(name).expanduser().resolve()) if Path(name).suffix else name


def _absolute_mentor(options):
    kind, _, path = options.mentor.partition(':')
    if kind != 'file':
        return options.mentor
    path = options.mentor[len('file:'):]
    return f'file:{_absolute(path)}'


@contextmanager
def running(options):
    """Run the three nodes as processes that end with the block, whatever happens in it."""
    arguments = ['--params-file', str(write_parameters(options))]
    shutil.rmtree(options.out / STATE, ignore_errors=True)  # of an earlier lesson
    if options.args.namespace:
        arguments += ['-r', f'__ns:=/{options.args.namespace.strip("/")}']
    if options.args.rate:
        arguments += ['-p', f'rate:={options.args.rate!r}']
    started = []
    try:
        for name in NODES:
            started.append(NodeProcess(name, arguments, options.out))
        yield started
    finally:
        for process in started:
            process.interrupt()
        for process in started:
            process.wait()


def lesson_parser():
    """`ArgumentParser` of a lesson."""
    parser = training_parser('lesson', 'Teach a learner over topics, in three processes.')
    parser.add_argument('--namespace', default='', metavar='NAME',
                        help='of the three nodes, for a second lesson at the same time')
    parser.add_argument('--rate', type=float, default=0.0, metavar='HZ',
                        help='steps per second, to watch; 0: as fast as it goes (default)')
    parser.add_argument('--respawn', action='store_true',
                        help='start a node again that was killed: nothing is lost')
    return parser


def main(argv):
    """Run the command; return the exit code."""
    return main_with(lesson_parser(), run, argv)


def run(options):
    """Hold the lesson, write the results, return the exit code."""
    if options.args.rate and not SLOWEST <= options.args.rate <= FASTEST:
        raise ConfigError(f'rate must be 0 or lie in [{SLOWEST}, {FASTEST}], '
                          f'got {options.args.rate:g}')
    if not re.fullmatch(r'(/?[A-Za-z_]\w*)*', options.args.namespace):
        raise ConfigError('a namespace is made of letters, digits, _ and /, '
                          f'got {options.args.namespace!r}')
    reference = ReferenceReturns(World(options.grid))  # before the learning: it finds maps without end
    try:
        advice, outcome = hold(options)
    except (NodeDied, LessonFailed) as failure:
        print(f'lesson: {failure}', file=sys.stderr)
        return 1
    report_training(options, reference, advice, [outcome])
    return 0


def hold(options, disturbing=nullcontext):
    """
    Return the mentor's advice and the outcome of a lesson in three processes.

    disturbing: called with the processes, a context that disturbs them while they learn.

    Raises
    ------
    NodeDied, LessonFailed: if there is no outcome.

    """
    rclpy.init(args=['lesson', '--ros-args', '--enclave', '/lesson'],
               signal_handler_options=SignalHandlerOptions.NO)
    try:
        with interrupts() as stop, topics_held(options.args.namespace):
            return _hold(options, stop, disturbing)
    finally:
        rclpy.try_shutdown()


def _hold(options, stop, disturbing):
    with progress_bar() as bar:
        task = bar.add_task(options.method, total=options.config.iterations, now='looks around')
        observer = RunMonitor(options.args.namespace, options.grid, lambda msg: bar.update(
            task, completed=msg.iteration,
            now=iteration_status(msg.mean_return, msg.confidence, observer.rate())))
        executor = SingleThreadedExecutor()
        executor.add_node(observer)
        make_sure_to_be_alone(observer, executor, stop)
        bar.update(task, now='starts')
        with running(options) as processes, disturbing(processes):
            observer.follow(processes)
            return watch(options, observer, executor, processes, stop,
                         lambda text: bar.update(task, now=text))


@contextmanager
def topics_held(namespace):
    """
    Hold the topics of a ROS domain and namespace for one lesson on this machine.

    Raises
    ------
    LessonFailed: if another lesson of this user holds them.

    """
    place = f'{os.getuid()}-{os.environ.get("ROS_DOMAIN_ID") or 0}-{namespace.replace("/", "_")}'
    with open(Path(tempfile.gettempdir()) / f'comply_ros-lesson-{place}.lock', 'w') as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise LessonFailed(TAKEN) from None
        yield


def make_sure_to_be_alone(observer, executor, stop):
    """
    Return if nobody is found to speak on these topics; discovery gets a second for it.

    Raises
    ------
    LessonFailed: if somebody does.

    """
    end = time.monotonic() + DISCOVERY
    while time.monotonic() < end:
        executor.spin_once(timeout_sec=LOOK)
        check(stop)
        if observer.speakers() > 0:
            raise LessonFailed(TAKEN)


def watch(options, observer, executor, processes, stop, tell):
    """Return the mentor's advice and the outcome, when the learner has finished and saved."""

    def spin_until(reached):
        while not reached():
            check(stop)
            for process in processes:
                if not options.args.respawn:
                    process.check()
                elif process.respawn():
                    tell(f'{process.name} was killed and starts again')
            executor.spin_once(timeout_sec=LOOK)
            if observer.words:
                tell('; '.join(observer.words.values()))
    spin_until(lambda: observer.began)
    spin_until(lambda: observer.progress and observer.progress[-1].finished)
    seconds = time.monotonic() - observer.began
    saved = save(observer, (options.out / 'learning.npz').resolve(), spin_until)
    return observer.advice, {
        'seed': options.seed, 'returns': [msg.mean_return for msg in observer.progress],
        'steps': observer.progress[-1].steps, 'wall_seconds': seconds, 'digest': saved.digest}


def save(observer, path, spin_until):
    """
    Return what the learner says when it has written all that it learned.

    Raises
    ------
    LessonFailed: if it cannot.

    """
    while True:
        saved, end = observer.save(path), time.monotonic() + SAVING
        spin_until(lambda: saved.done() or time.monotonic() > end)
        if saved.done() and not saved.result().message.startswith(ANOTHER):
            break  # else it was killed meanwhile, or somebody else answered: it is asked again
    if not saved.result().success:
        raise LessonFailed(f'the learner could not save: {saved.result().message}')
    return saved.result()
