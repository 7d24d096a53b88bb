# SPDX-License-Identifier: Apache-2.0
"""The node of a lesson that the lesson does not start: it is found by its topic."""

from collections.abc import Callable
from dataclasses import replace
import time
from typing import Any

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from comply_ros.nodes.run_monitor import LessonFailed
from comply_ros.nodes.spin import POLL_PERIOD
from comply_ros.nodes.topics import (
    ACTION,
    publisher_names,
    reader,
    RECOMMENDATION,
    STATE,
    Topic,
    WORLD,
)
from comply_ros.protocol.messages import WorldDescription
from comply_ros.protocol.world_description import world_from_description
from comply_ros.storage.training_spec import in_world
from comply_ros.terminal.training_options import TrainingOptions

# The topic by which each part is found, whatever its node is called.
PARTS: dict[str, Topic] = {'world': STATE, 'mentor': RECOMMENDATION, 'learner': ACTION}
FIND_TIME = 10.0  # seconds in which a node must be found


def find_external(node: Node, executor: SingleThreadedExecutor, part: str,
                  check: Callable[[], Any]) -> str:
    """
    Wait for the external node of a lesson; return its full name.

    check: called again and again meanwhile; it may raise.

    Raises
    ------
    LessonFailed: if there is none, or more than one.

    """
    topic, end = PARTS[part], time.monotonic() + FIND_TIME
    while not (names := publisher_names(node, topic)) and time.monotonic() < end:
        executor.spin_once(timeout_sec=POLL_PERIOD)
        check()
    if len(names) != 1:
        raise LessonFailed(
            f'an external {part} must be the only publisher on the topic {topic.name}, got '
            f'{", ".join(names) or f"none within {FIND_TIME:g} s"}')
    return names[0]


def external_world(namespace: str, check: Callable[[], Any]) -> WorldDescription:
    """
    Wait for the description of a world; return it. check: as in `find_external`.

    Raises
    ------
    LessonFailed: if none comes.

    """
    node, found = rclpy.create_node('lesson', namespace=namespace), []
    executor, read = SingleThreadedExecutor(), reader(WORLD)
    executor.add_node(node)
    node.create_subscription(WORLD.message, WORLD.name, lambda content: found.append(
        read(content)), WORLD.qos, raw=True)
    end = time.monotonic() + FIND_TIME
    while not found and time.monotonic() < end:
        executor.spin_once(timeout_sec=POLL_PERIOD)
        check()
    executor.shutdown()
    node.destroy_node()
    if not found:
        raise LessonFailed('an external world must publish its description on the topic '
                           f'{WORLD.name}, got none within {FIND_TIME:g} s')
    return found[-1]


def in_external_world(options: TrainingOptions, msg: WorldDescription) -> TrainingOptions:
    """
    Return the options of a lesson in an external world: its map is what the world describes.

    Raises
    ------
    LessonFailed: for a world that cannot be learned in by a lesson.
    MentorError, PolicyError, LearningError: as `in_world`.

    """
    try:
        source = world_from_description(msg)
    except ValueError as error:
        raise LessonFailed(f'an external world must be complete: {error}') from None
    return in_world(options, msg.name, source)


def with_external(options: TrainingOptions, part: str, name: str) -> TrainingOptions:
    """Return the options of a lesson with an external mentor or learner, named after its node."""
    if part == 'mentor':
        return replace(options, mentor=f'external {name}')
    if part == 'learner':
        return replace(options, method=f'external {name}', settings={},
                       config=replace(options.config, measuring_iterations=0))
    return options
