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
    'mentor': ('nodes.mentor', 0),
    'learner': ('nodes.learner', 0),
    'teleop_mentor': ('nodes.teleop_mentor', 0),
    'dashboard': ('dashboard.server', 0),
    'viewer': ('nodes.viewer', 0),
    'record': ('nodes.record', 0),
    'fault_injector': ('nodes.fault_injector', 0),
    'lesson': ('nodes.lesson', 130),
    'train': ('experiments.train', 130),
    'reproduce': ('experiments.reproduce', 130),
    'sweep': ('experiments.sweep', 130),
    'replay': ('bags.replay', 130),
    'plot': ('bags.plot', 130),
}


def run(name: str) -> int:
    """Run an executable with the arguments of this process; return its exit code."""
    module, interrupted = EXECUTABLES[name]
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: os._exit(interrupted))
    from comply_ros.storage.kernel_cache import use_kernel_cache  # only now can Ctrl-C end it
    use_kernel_cache()
    code = import_module(f'comply_ros.{module}').main(sys.argv)
    if name == 'train':
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)  # a quarter of a second sooner than by unloading the compiler
    return code


def _entry_point(name: str) -> Callable[[], int]:
    return lambda: run(name)


# Entry points of `setup.py`: one function for each row, such as `executables.learner`.
globals().update({name: _entry_point(name) for name in EXECUTABLES})
