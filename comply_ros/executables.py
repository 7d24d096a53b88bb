# SPDX-License-Identifier: Apache-2.0
"""The table of executables. It imports next to nothing, so that Ctrl-C works from the start."""

from collections.abc import Callable
from importlib import import_module
import os
import signal
import sys

# Name: module with `main(argv)`, exit code when Ctrl-C ends it before the module takes over.
EXECUTABLES = {
    'grid_world': ('nodes.grid_world', 0),
    'gym_world': ('nodes.gym_world', 0),
    'mentor': ('nodes.mentor', 0),
    'learner': ('nodes.learner', 0),
    'teleop_mentor': ('nodes.teleop_mentor', 0),
    'dashboard': ('dashboard.server', 0),
    'viewer': ('nodes.viewer', 0),
    'record': ('nodes.record', 0),
    'fault_injector': ('nodes.fault_injector', 0),
    'check': ('nodes.check', 130),
    'lesson': ('nodes.lesson', 130),
    'train': ('experiments.train', 130),
    'reproduce': ('experiments.reproduce', 130),
    'sweep': ('experiments.sweep', 130),
    'replay': ('bags.replay', 130),
    'plot': ('bags.plot', 130),
}

# The same for what only a clone has: `scripts/demo`.
SCRIPTS = {'demo': ('dashboard.demo', 130)}
PROGRAMS = {**EXECUTABLES, **SCRIPTS}

# Extras of `setup.py`: what only some executables need, as it is imported and as pip names it.
EXTRAS = {
    'dashboard': {'fastapi': 'fastapi', 'nicegui': 'nicegui', 'uvicorn': 'uvicorn'},
    'bags': {'rosbags': 'rosbags', 'mcap': 'mcap', 'lz4': 'lz4', 'zstandard': 'zstandard'},
    'cluster': {'distributed': 'distributed'},
    'gym': {'gymnasium': 'gymnasium'},
}
# ROS packages that are imported, besides `comply_msgs`.
ROS_PACKAGES = (
    'ament_index_python', 'builtin_interfaces', 'diagnostic_msgs', 'geometry_msgs', 'nav_msgs',
    'rcl_interfaces', 'rclpy', 'sensor_msgs', 'std_msgs', 'std_srvs', 'tf2_msgs',
    'visualization_msgs')


def run(name: str) -> int:
    """Run an executable with the arguments of this process; return its exit code, as `start`."""
    needs_ros = PROGRAMS[name][0].startswith(('nodes.', 'dashboard.'))
    return start(name, needs_ros, lambda: _run(name))


def start(name: str, needs_ros: bool, program: Callable[[], int]) -> int:
    """
    Return the exit code of a program, which imports what it needs when it is called.

    If a package or the middleware of ROS is not installed, one line says which and what to do;
    the code is 2.
    """
    remedy = _missing_middleware() if needs_ros else ''
    try:
        if not remedy:
            return program()
    except ModuleNotFoundError as error:
        remedy = _remedy((error.name or '').split('.')[0])
        if not remedy:
            raise
    print(f'{name}: {remedy}', file=sys.stderr)
    return 2


def _missing_middleware() -> str:
    """One sentence where RMW_IMPLEMENTATION is not installed, on which rclpy ends the process."""
    wanted = os.environ.get('RMW_IMPLEMENTATION')
    if not wanted:
        return ''
    try:
        from ament_index_python import get_resources
        installed = sorted({*get_resources('rmw_typesupport')} - {'rmw_implementation'})
    except (ImportError, OSError):  # no ROS is sourced: that is said where it is needed
        return ''
    if not installed or wanted in installed:
        return ''
    return ('environment variable RMW_IMPLEMENTATION must name a middleware that is installed '
            f'({", ".join(installed)}), got {wanted!r}: unset it, or install that ROS package')


def _remedy(package: str) -> str:
    """One sentence on how to install a package that is missing; empty for one of our own."""
    for extra, packages in EXTRAS.items():
        if package in packages:
            names = ' '.join(packages.values())
            return (f"needs the Python package {package} (extra '{extra}' of comply_ros), which "
                    f'is not installed: python3 -m pip install {names}')
    if package == 'comply_msgs':
        return ('needs the messages of comply_ros, the ROS package comply_msgs, which is not '
                'built, or not sourced: . install/setup.bash')
    if package in ROS_PACKAGES:
        return (f'needs the ROS package {package}, which is not installed, or not sourced: '
                '. /opt/ros/$ROS_DISTRO/setup.bash')
    if package in ('', 'comply_ros'):
        return ''
    return (f'needs the Python package {package}, which is not installed: in a workspace, rosdep '
            'install --from-paths src; without ROS, python3 -m pip install FOLDER_OF_COMPLY_ROS')


def _run(name: str) -> int:
    module, interrupted = PROGRAMS[name]
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: os._exit(interrupted))
    from comply_ros.storage.kernel_cache import use_kernel_cache  # only now can Ctrl-C end it
    use_kernel_cache()
    from comply_ros.terminal.standard_output import standard_output
    with standard_output():
        code = import_module(f'comply_ros.{module}').main(sys.argv)
    if name == 'train':
        sys.stderr.flush()
        os._exit(code)  # a quarter of a second sooner than by unloading the compiler
    return code


def _entry_point(name: str) -> Callable[[], int]:
    return lambda: run(name)


# One function for each row, of which `setup.py` makes entry points: such as `executables.learner`.
globals().update({name: _entry_point(name) for name in PROGRAMS})
