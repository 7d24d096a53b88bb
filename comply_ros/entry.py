# SPDX-License-Identifier: Apache-2.0
"""Where every executable starts. It imports next to nothing: Ctrl-C is heard from here on."""

from importlib import import_module
import os
import signal
import sys


def _start(module, interrupted):
    """Run `main` of a module; until it takes over, Ctrl-C ends the process with that code."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: os._exit(interrupted))
    return import_module(f'comply_ros.{module}').main(sys.argv)


def grid_world():
    """Run the node that publishes states and rewards."""
    return _start('nodes.grid_world', interrupted=0)


def mentor():
    """Run the node that serves recommended actions."""
    return _start('nodes.mentor', interrupted=0)


def learner():
    """Run the node that learns."""
    return _start('nodes.learner', interrupted=0)


def fault_injector():
    """Run the node that drops, delays, duplicates and reorders what others say."""
    return _start('nodes.fault_injector', interrupted=0)


def viewer():
    """Run the node that shows the conversation in standard messages."""
    return _start('nodes.viewer', interrupted=0)


def teleop_mentor():
    """Be the mentor at a terminal."""
    return _start('nodes.teleop_mentor', interrupted=0)


def lesson():
    """Run the three nodes as processes, to their results."""
    return _start('nodes.lesson', interrupted=130)


def record():
    """Run the node that writes the conversation to a bag."""
    return _start('nodes.record', interrupted=0)


def replay():
    """Prove that a fresh learner would have said what is in a bag."""
    return _start('bags.replay', interrupted=130)


def plot():
    """Draw what is in a bag."""
    return _start('bags.plot', interrupted=130)


def topic():
    """Look at topics where there is no `ros2 topic`."""
    return _start('nodes.topic', interrupted=0)


def dashboard():
    """Serve a page on which a lesson is seen, and a person is its mentor."""
    return _start('dashboard.serving', interrupted=0)


def service():
    """Look at services, and call one, where there is no `ros2 service`."""
    return _start('nodes.service', interrupted=0)


def param():
    """Look at parameters, and set them, where there is no `ros2 param`."""
    return _start('nodes.param', interrupted=0)


def train():
    """Run the same learning in one process."""
    code = _start('experiments.train', interrupted=130)
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)  # a quarter of a second sooner than by taking the compiler apart


def reproduce():
    """Regenerate the figures of the report."""
    return _start('experiments.reproduce', interrupted=130)


def sweep():
    """Run many learnings, into one table."""
    return _start('experiments.sweep', interrupted=130)
