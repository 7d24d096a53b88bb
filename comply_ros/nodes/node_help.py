# SPDX-License-Identifier: Apache-2.0
"""What `--help` prints for a node: its parameters, with their defaults and ranges."""

import shutil
import textwrap

from comply_ros.learner.presets import find_method
from comply_ros.nodes import parameters
from comply_ros.nodes.parameters import config_parameters, Parameter

MIN_COLUMNS, MAX_COLUMNS = 40, 100
# The parameters of each executable's node; that of the page also serves the node `mentor`.
NODE_PARAMETERS: dict[str, tuple[Parameter, ...]] = {
    'grid_world': (parameters.MAP, parameters.PROFILE, parameters.SEED, parameters.RATE,
                   parameters.STATE_DIR),
    'gym_world': (parameters.SEED, parameters.ENV, parameters.ENV_ARGS, parameters.MODULE,
                  parameters.BINS, parameters.LIMITS, parameters.USE_TABLE, parameters.IMAGE_RATE,
                  parameters.RATE, parameters.STATE_DIR),
    'mentor': (parameters.MENTOR, parameters.MENTOR_NAME, parameters.MENTOR_SEED,
               parameters.BUDGET, parameters.ADVISING, parameters.ROBOTS, parameters.STATE_DIR),
    'learner': (parameters.METHOD, parameters.PROFILE, parameters.SEED,
                *config_parameters(find_method(parameters.METHOD.default,
                                               parameters.PROFILE.default)),
                parameters.REMEMBERS_ADVICE, parameters.INITIAL_LEARNING, parameters.MAP_PERIOD,
                parameters.MENTORS, parameters.ADVICE_TIMEOUT, parameters.OWN_ADVICE_TIMEOUT,
                parameters.END_WHEN_FINISHED, parameters.STATE_DIR),
    'teleop_mentor': (parameters.MENTOR._replace(default='none'), parameters.MENTOR_NAME,
                      parameters.MENTOR_SEED, parameters.POLICY_FILE, parameters.PATIENCE,
                      parameters.STATE_DIR),
    'viewer': (parameters.FRAME, parameters.ROBOT_FRAME, parameters.CELL_SIZE,
               parameters.TRAIL_LENGTH, parameters.ROBOT_RATE, parameters.MAP_RATE),
    'dashboard': (parameters.ADDRESS, parameters.PORT, parameters.TOKEN_FILE, parameters.TEACH,
                  parameters.PERSON_NAME),
    'record': (parameters.BAG, parameters.RECORDED),
    'fault_injector': (parameters.TOPICS, parameters.SEED, parameters.DEPTH, *parameters.FAULTS),
}


def help_text(name: str) -> str:
    """Text of `--help` for the node of an executable, for the width of the terminal."""
    columns = min(max(shutil.get_terminal_size().columns, MIN_COLUMNS), MAX_COLUMNS)
    lines = [f'usage: {name} [--ros-args [-p NAME:=VALUE] [-r FROM:=TO] [--log-level LEVEL] ...]',
             '', 'parameters:']
    for parameter in (*NODE_PARAMETERS[name], *parameters.ROS_PARAMETERS):
        lines.append(f'  {parameter.name}')
        lines += textwrap.wrap(f'{parameter.description} ({_values(parameter)})', columns,
                               initial_indent='      ', subsequent_indent='      ')
    return '\n'.join(lines)


def _values(parameter: Parameter) -> str:
    """Return default, range, choices of a parameter, and whether it can change, as text."""
    default = parameter.default
    texts = ['default: ' + (repr(default) if default == '' else
                            str(default).lower() if isinstance(default, bool) else f'{default}')]
    if parameter.range:
        low, high = (f'{each:g}' if isinstance(each, float) else str(each)
                     for each in parameter.range)
        texts.append(f'from {low} to {high}')
    if parameter.choices:
        texts.append('one of ' + ', '.join(parameter.choices))
    if not parameter.read_only:
        texts.append('may be set while the node runs')
    return '; '.join(texts)
