# SPDX-License-Identifier: Apache-2.0
"""Start worlds, mentors and learners: `ros2 launch comply_ros teach.launch.py`."""

import atexit
from collections.abc import Callable, Iterable
from pathlib import Path
import shlex
import shutil
import sys
import tempfile
from typing import Any

from ament_index_python import get_package_prefix, PackageNotFoundError
from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction, Shutdown
from launch.events.process import ProcessExited
from launch.logging import get_logger
from launch.substitutions import (
    LaunchConfiguration,
    PathJoinSubstitution,
    TextSubstitution,
)
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

from comply_ros.learner.presets import find_method, METHODS
from comply_ros.mentor.several_mentors import free_name, joined, PERSON, split_mentors
from comply_ros.nodes.lesson_parameters import mentor_node
from comply_ros.nodes.node_help import NODE_PARAMETERS
from comply_ros.nodes.node_processes import yaml_for_rcl
from comply_ros.nodes.parameters import mentor_of_timeout, METHOD, PROFILE
from comply_ros.numerics.similar_name import did_you_mean

DEFAULT_FILE = PathJoinSubstitution([FindPackageShare('comply_ros'), 'config', 'teach.yaml'])
# Name, default and description. An empty value leaves the parameter to the file.
ARGUMENTS = (
    ('map', '', 'name of a map of the package, or a map file'),
    ('method', '', f'method of the learner: {", ".join(METHODS["published"])}'),
    ('mentor', '', 'optimal, random, adversarial, noisy:P, snapshot:Q, file:PATH, '
     'learned:FILE.npz, learner:/NAMESPACE or none; with @C behind it, in a share C of the states '
     'only'),
    ('mentors', '', "several mentors instead of one, such as 'optimal anna=noisy:0.6', where the "
     'second has a name; each is a node mentor_NAME'),
    ('mentor_seed', '', 'which one of the mentors of this kind; each of several has the next '
     'number'),
    ('budget', '', 'recommendations that the mentor may give; 0: no limit'),
    ('advice_timeout', '', 'seconds to wait for advice in a state; 0.0: no limit; for one of '
     'several mentors: NAME.advice_timeout, such as anna.advice_timeout:=2.0'),
    ('rate', '', 'steps per second; 0: as fast as possible'),
    ('seed', '', 'seed of the random numbers of world and learner'),
    ('iterations', '', 'iterations to learn for; 0: without end'),
    ('initial_learning', '', 'saved learning.npz to begin with; it is no checkpoint'),
    ('learns', '', 'false: act for ever by the initial learning, and learn nothing'),
    ('profile', '', 'report: settings of the text of the report; published: of its runs'),
    ('namespace', '', 'namespace of the nodes, for a second robot'),
    ('robots', '1', 'number of robots; with more than one, each has a world, a learner and the '
     'same mentors in a namespace robot_1, robot_2, ..., and the next seed'),
    ('params_file', DEFAULT_FILE, 'parameter file; the arguments above override it'),
    ('state_dir', '', 'folder for the state that the nodes need to continue after a kill'),
    ('respawn', 'false', 'start killed nodes again; with a state_dir nothing is lost'),
    ('end_when_finished', 'true', 'end all nodes when the learner has learned its last iteration; '
     'false: they stay, and what was learned can be looked at and saved'),
    ('viewer', 'false', 'publish maps, markers and numbers that RViz and Foxglove show'),
    ('rviz', 'false', 'start RViz and the viewer; needs the package rviz2'),
    ('dashboard', 'false', 'serve the page that shows the run, on http://localhost:8080'),
    ('teach', 'false', 'whether you may teach on that page: false (it only watches), auto (it '
     'watches beside mentors, and offers to teach too) or true'),
    ('record', 'false', 'record all messages to a bag in runs/'),
    ('log_level', 'info', 'log level of the nodes'),
)
# Of arguments that are never empty; the others are checked in `nodes`, or by the node.
CHOICES = {
    'respawn': ['true', 'false'],
    'end_when_finished': ['true', 'false'],
    'viewer': ['true', 'false'],
    'rviz': ['true', 'false'],
    'dashboard': ['true', 'false'],
    'teach': ['auto', 'true', 'false'],
    'record': ['true', 'false'],
    'log_level': ['debug', 'info', 'warn', 'error', 'fatal'],
}
# The nodes, and the arguments that set their parameters.
NODES = {
    'grid_world': ('map', 'profile', 'seed', 'rate', 'state_dir'),
    'mentor': ('mentor', 'mentor_seed', 'budget', 'state_dir'),
    'learner': ('method', 'profile', 'seed', 'iterations', 'initial_learning', 'learns',
                'state_dir', 'end_when_finished', 'advice_timeout'),
}
RENAMED = {'mentor_seed': 'seed'}  # arguments with another name than their parameter
# Topics that RViz shows; in a namespace they are remapped.
VIEW_TOPICS = ('map', 'trust', 'values', 'places', 'mentor', 'policy', 'trail', 'robot')
NOT_TEXT = ('seed', 'mentor_seed', 'budget', 'rate', 'iterations', 'learns', 'end_when_finished',
            'advice_timeout')
MOST_ROBOTS = 64
HAS_TERMINAL = sys.stdout.isatty()  # then nodes print colors; in a pipe or a file they do not
INVALID_ARGUMENTS = 2  # exit code of a node; it would fail again


class NodeFailed(RuntimeError):
    """A node that ended with an error; it ends the launch, which then has the exit code 1."""


def end_after(name: str, respawns: bool = False, is_needed: Callable[[], bool] = lambda: True,
              ) -> Callable[[ProcessExited, LaunchContext], Any]:
    """
    Return the exit handler of a node: end the launch, unless the node is started again.

    is_needed: called where the node ends without an error; whether the launch ends as well.
    """
    def on_exit(event: ProcessExited, context: LaunchContext) -> Shutdown | None:
        if context.is_shutdown or respawns and event.returncode not in (0, INVALID_ARGUMENTS):
            return None
        if event.returncode:  # of a Shutdown, the exit code would be 0
            raise NodeFailed(f'{name} ended with exit code {event.returncode}')
        return Shutdown(reason=f'{name} has ended') if is_needed() else None
    return on_exit


def write_texts(name: str, texts: dict[str, Any]) -> str:
    """Write a parameter file with texts in quotes, which launch_ros omits; return its path."""
    folder = Path(tempfile.mkdtemp(prefix='comply_ros_'))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    path = folder / f'{name}.yaml'
    path.write_text(yaml_for_rcl({f'/**/{name}': {'ros__parameters': texts}}))
    return str(path)


def nodes(context: LaunchContext) -> list[Node]:
    """Return the nodes of each robot and the viewers; raises ValueError for what cannot be."""
    warn_of_misspelt(context.argv)
    timeouts = filter(mentor_of_timeout, context.launch_configurations)
    given = {name: LaunchConfiguration(name).perform(context)
             for name in (*(name for name, _, _ in ARGUMENTS), *timeouts)}
    if not Path(given['params_file']).is_file():  # launch would warn, and start without it
        raise ValueError(f'params_file must be a file, got {given["params_file"]!r}')
    find_method(given['method'] or METHOD.default, given['profile'] or PROFILE.default)
    mentors, robots = mentors_of(given), robots_of(given)
    learning = {namespace for namespace, _ in robots}
    return [*teachers(given, mentors, [namespace for namespace, _ in robots]),
            *(node for namespace, seed in robots
              for node in (*robot(given, namespace, seed, list(mentors), learning),
                           *viewers({**given, 'namespace': namespace}))), *observers(given)]


def mentors_of(given: dict[str, str]) -> dict[str, str]:
    """Return several mentors by their names, none where there is one; may raise ValueError."""
    if given['mentor'] and given['mentors']:
        raise ValueError(f'either mentor or mentors must be given, got {given["mentor"]!r} and '
                         f'{given["mentors"]!r}')
    return split_mentors(joined(shlex.split(given['mentors']))) if given['mentors'] else {}


def robots_of(given: dict[str, str]) -> list[tuple[str, str]]:
    """Return namespace and seed of each robot, as texts; raises ValueError."""
    count = whole_number('robots', given['robots'])
    if not 1 <= count <= MOST_ROBOTS:
        raise ValueError(f'robots must lie in [1, {MOST_ROBOTS}], got {count}')
    if count == 1:
        return [(given['namespace'], given['seed'])]
    for name in ('rviz', 'dashboard', 'record'):
        if given[name] == 'true':
            raise ValueError(f'{name}:=true must be used with one robot, got robots:={count}: '
                             'start it beside them, in the namespace of one of them')
    seed, outside = whole_number('seed', given['seed'] or '0'), given['namespace'].rstrip('/')
    return [(f'{outside}/robot_{number + 1}', str(seed + number)) for number in range(count)]


def whole_number(name: str, text: str) -> int:
    """Return the number of an argument; raises ValueError if it is none."""
    if not text.isdecimal():
        raise ValueError(f'{name} must be a whole number, got {text!r}')
    return int(text)


def teachers(given: dict[str, str], mentors: dict[str, str], robots: list[str]) -> list[Node]:
    """
    Return the mentors, each for all robots.

    mentors: by their names; empty for the one of the argument `mentor`.
    robots: their namespaces; a mentor is in the first one, and teaches the others too.
    """
    given, first = {**given, 'namespace': robots[0]}, given['mentor_seed'] or '0'
    others = {'robots': [f'/{each.strip("/")}' for each in robots[1:]]} if robots[1:] else {}
    several = [node_of('mentor', mentor_node(name), given, {
        'mentor': text, 'name': name, 'seed': whole_number('mentor_seed', first) + place,
        **others}) for place, (name, text) in enumerate(mentors.items())]
    return several or [node_of('mentor', 'mentor', given, others)]


def robot(given: dict[str, str], namespace: str, seed: str, mentors: list[str],
          learning: set[str]) -> list[Node]:
    """
    Return the world and the learner of one robot.

    mentors: names of those of several, which the learner waits for.
    learning: namespaces whose learner has not ended; the launch ends with the last one.
    """
    given = {**given, 'namespace': namespace, 'seed': seed}

    def is_last() -> bool:
        learning.discard(namespace)
        return not learning
    return [node_of('grid_world', 'grid_world', given, {}),
            node_of('learner', 'learner', given, {'mentors': mentors} if mentors else {},
                    is_last)]


def node_of(executable: str, name: str, given: dict[str, str], parameters: dict[str, Any],
            is_needed: Callable[[], bool] = lambda: True) -> Node:
    """
    Return a node, with the parameters that the arguments set.

    parameters: of this node only; they win.
    is_needed: as `end_after` takes it.
    """
    timeouts = list(filter(mentor_of_timeout, given)) if executable == 'learner' else []
    set_here = [each for each in (*NODES[executable], *timeouts)
                if given[each] and RENAMED.get(each, each) not in parameters]
    values = {RENAMED.get(each, each): ParameterValue(
        TextSubstitution(text=given[each]), value_type=None)
              for each in set_here if each in (*NOT_TEXT, *timeouts)}
    texts = {**{each: given[each] for each in set_here if RENAMED.get(each, each) not in values},
             **parameters}
    files = [given['params_file'], *([write_texts(name, texts)] if texts else [])]
    respawns = given['respawn'] == 'true'
    return Node(
        package='comply_ros', executable=executable, name=name, namespace=given['namespace'],
        parameters=[*files, values],  # the file first, so that arguments win
        arguments=['--ros-args', '--enclave', f'/{executable}', '--log-level',
                   given['log_level']],
        output='screen', emulate_tty=HAS_TERMINAL, respawn=respawns, respawn_delay=0.5,
        on_exit=end_after(name, respawns, is_needed))


def warn_of_misspelt(argv: Iterable[str]) -> None:
    """
    Log each argument that resembles one of this file; `ros2 launch` accepts any.

    Others may belong to a launch file that includes this one.
    """
    known = [name for name, _, _ in ARGUMENTS]
    for name in (text.partition(':=')[0] for text in argv):
        mentor, dot, _ = name.rpartition('.')
        own = f'{mentor}.advice_timeout'
        question = did_you_mean(name, [own] if dot else known, before='; ')
        if question and not mentor_of_timeout(name):
            get_logger('teach.launch.py').warning(
                f'argument {name!r} is unknown and has no effect{question}')


def viewers(given: dict[str, str]) -> list[Node]:
    """Return the viewer and RViz if they are wanted; they may end before the nodes."""
    started, namespace = [], given['namespace'].strip('/')
    if 'true' in (given['viewer'], given['rviz']):
        started.append(Node(
            package='comply_ros', executable='viewer', name='viewer', namespace=namespace,
            parameters=[given['params_file']], output='screen', emulate_tty=HAS_TERMINAL,
            on_exit=end_after('viewer', is_needed=lambda: False),
            arguments=['--ros-args', '--enclave', '/viewer', '--log-level', given['log_level']]))
    if given['rviz'] == 'true':
        check_rviz()
        started.append(Node(
            package='rviz2', executable='rviz2', name='rviz', namespace=namespace,
            arguments=['-d', PathJoinSubstitution(
                [FindPackageShare('comply_ros'), 'rviz', 'teach.rviz'])],
            remappings=[(f'/view/{each}', f'/{namespace}/view/{each}')
                        for each in VIEW_TOPICS if namespace]))
    return started


def observers(given: dict[str, str]) -> list[Node]:
    """
    Return the page and the recorder if they are wanted.

    The person who teaches beside mentors with names is told its own: all nodes start at once, and
    the page could not find the others in time.
    """
    names = [*mentors_of(given)]
    person = {'name': free_name(PERSON, names)} if given['teach'] == 'true' and any(names) else {}
    return [Node(
        package='comply_ros', executable=name, name=name, namespace=given['namespace'],
        parameters=[given['params_file'], values], output='screen', emulate_tty=HAS_TERMINAL,
        on_exit=end_after(name, is_needed=lambda: False),
        arguments=['--ros-args', '--enclave', f'/{name}', '--log-level', given['log_level']])
        for name, values in (('record', {}), ('dashboard', {'teach': given['teach'], **person}))
        if given[name] == 'true']


def description_of(name: str, default: Any, text: str) -> str:
    """Return the description of an argument; of an empty one, with what counts instead."""
    for node, arguments in NODES.items():
        if name in arguments and default == '':
            value, = (each.default for each in NODE_PARAMETERS[node]
                      if each.name == RENAMED.get(name, name))
            shown = str(value).lower() if isinstance(value, bool) else value
            return f'{text}; default: that of params_file, else {shown if shown != "" else "none"}'
    return text


def check_rviz() -> None:
    """Raise ValueError if RViz is not installed."""
    try:
        get_package_prefix('rviz2')
    except PackageNotFoundError:
        raise ValueError('rviz:=true needs the package rviz2, which is not installed: install it '
                         '(sudo apt install ros-$ROS_DISTRO-rviz2), or use viewer:=true and '
                         'Foxglove') from None


def generate_launch_description() -> LaunchDescription:
    """Return the arguments and the nodes."""
    arguments = [DeclareLaunchArgument(name, default_value=default,
                                       description=description_of(name, default, text),
                                       choices=CHOICES.get(name))
                 for name, default, text in ARGUMENTS]
    return LaunchDescription([*arguments, OpaqueFunction(function=nodes)])
