# SPDX-License-Identifier: Apache-2.0
"""The parameters of the three nodes of a lesson, and which node is its world."""

from dataclasses import asdict
import json
from pathlib import Path
from typing import Any

from comply_ros.mentor.mentor_spec import FROM_FILES
from comply_ros.mentor.several_mentors import split_mentors
from comply_ros.nodes.node_processes import yaml_for_rcl
from comply_ros.storage.file_system import absolute_path
from comply_ros.storage.gymnasium_world import read_environment_name
from comply_ros.storage.map_name import absolute_name, parse_map_name
from comply_ros.terminal.training_options import TrainingOptions
from comply_ros.world.state_action_spaces import Spaces

NODES = ('grid_world', 'mentor', 'learner')
STATE = 'state'  # folder in that of the results, for the checkpoints of `--respawn`


def world_node(options: TrainingOptions) -> str:
    """Return the name of the node that is the world of a lesson."""
    return 'gym_world' if isinstance(options.source, Spaces) else NODES[0]


def world_parameters(options: TrainingOptions) -> dict[str, Any]:
    """Return the parameters by which that node has the map of a lesson."""
    if world_node(options) == NODES[0]:
        return {'map': absolute_name(options.map_name), 'profile': options.profile}
    _, target, arguments = parse_map_name(options.map_name)
    env = read_environment_name(target, arguments)
    return {'env': env.name,
            'env_args': json.dumps(env.arguments, default=str, ensure_ascii=False),
            'bins': list(env.bins), 'use_table': env.use_table,
            'limits': '; '.join(f'{low!r},{high!r}' for low, high in env.limits)}


def mentor_node(name: str) -> str:
    """Return the name of the node of a mentor."""
    return f'{NODES[1]}_{name}' if name else NODES[1]


def _with_absolute_path(mentor: str) -> str:
    kind, _, value = mentor.partition(':')
    return f'{kind}:{absolute_path(value)}' if kind in FROM_FILES else mentor


def write_parameters(options: TrainingOptions) -> Path:
    """Write the parameter file of the nodes that a lesson starts; return its path."""
    initial = absolute_path(options.initial_learning) if options.initial_learning else ''
    state = {'state_dir': str((options.out / STATE).resolve())} if options.args.respawn else {}
    mentors = {name: _with_absolute_path(text)
               for name, text in split_mentors(options.mentor).items()}
    parameters = {} if options.args.external == 'world' else {
        world_node(options): {**world_parameters(options), 'seed': options.seed, **state}}
    parameters |= {
        **{mentor_node(name): {
            'mentor': text, 'name': name, 'seed': options.mentor_seed + place,
            'budget': options.budget, 'advising': options.advising, **state}
           for place, (name, text) in enumerate(mentors.items())},
        'learner': {'method': options.method, 'profile': options.profile, 'seed': options.seed,
                    **asdict(options.config), **state, 'initial_learning': initial,
                    'mentors': list(mentors),
                    'remembers_advice': not (options.budget and options.advising == 'mistakes')}}
    if options.args.external == 'mentor':
        parameters = {name: values for name, values in parameters.items()
                      if name not in map(mentor_node, mentors)}
    parameters.pop(options.args.external, None)
    path = options.out / 'parameters.yaml'
    table = {f'/**/{name}': {'ros__parameters': values} for name, values in parameters.items()}
    path.write_text('# What this lesson was run with: --ros-args --params-file parameters.yaml\n'
                    + yaml_for_rcl(table), encoding='utf-8')
    return path
