# SPDX-License-Identifier: Apache-2.0
"""Nodes with timers in them, and with another executor or other QoS for comparison."""

from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import Path
import sys
from typing import Any

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions

from comply_ros.nodes import publish_throttle, spin, topics
from comply_ros.nodes.step_compiler import StepCompiler
from comply_ros.protocol.messages import StateReward
from comply_ros.protocol.world import WorldMachine
from comply_ros.storage.kernel_cache import use_kernel_cache
from comply_ros.terminal.interrupts import end_with_parent, interrupts
from tools.benchmarks.callback_timer import CallbackTimer, ReactionTimer
from tools.benchmarks.empty_ring import SPIN_TIMEOUT
from tools.benchmarks.step_times import StepTimes

MAKERS = {'grid_world': 'GridWorldNode', 'mentor': 'mentors_of_robots', 'learner': 'LearnerNode'}
LOOP_TOPICS = ('STATE', 'RECOMMENDATION', 'ACTION')


def use_default_executor() -> None:
    """Spin nodes as `rclpy.spin` does."""
    setattr(spin, 'EventsExecutor', SingleThreadedExecutor)


def use_best_effort() -> None:
    """Make the three topics of the loop best effort and volatile."""
    qos = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT,
                     durability=DurabilityPolicy.VOLATILE)
    for name in LOOP_TOPICS:
        setattr(topics, name, getattr(topics, name)._replace(qos=qos))


def use_unthrottled_maps() -> None:
    """Publish maps over all states however much the last ones cost."""
    setattr(publish_throttle, 'TIMES', 0)


def use_plain_steps() -> None:
    """Step a learner with a model in plain Python to the end."""
    setattr(StepCompiler, 'tick', lambda compiler, agent: None)


PLAIN_STEPS = 'plain_steps'
VARIANTS = {'default_executor': use_default_executor, 'best_effort': use_best_effort,
            'unthrottled_maps': use_unthrottled_maps, PLAIN_STEPS: use_plain_steps}
TIMED, REACTION = 'timed', 'reaction'
TIMERS = {TIMED: CallbackTimer, REACTION: ReactionTimer}  # variants that write times of callbacks


def recorded(on_action: Callable[[Any, Any], Any],
             record: Callable[[bool], None]) -> Callable[[Any, Any], Any]:
    """Return `WorldMachine.on_action` that also records the steps and the starts of episodes."""
    def on_recorded_action(self: WorldMachine, msg: Any) -> Any:
        outputs = on_action(self, msg)
        if outputs and type(outputs[-1]) is StateReward:
            record(outputs[-1].step == 0)
        return outputs
    return on_recorded_action


def spin_together(makers: Sequence[Callable[[], Node | list[Node]]], argv: Sequence[str]) -> None:
    """Spin several nodes on one executor until the process is interrupted."""
    with interrupts() as stop:
        rclpy.init(args=list(argv), signal_handler_options=SignalHandlerOptions.NO)
        executor, made = EventsExecutor(), [make() for make in makers]
        for each in made:
            for node in each if isinstance(each, list) else [each]:
                executor.add_node(node)
        while not stop.is_set():
            executor.spin_once(timeout_sec=SPIN_TIMEOUT)
        rclpy.try_shutdown()


def main(argv: Sequence[str]) -> int:
    """
    Run nodes; return the exit code.

    argv: name, parent, folder, NODE+NODE,VARIANT,VARIANT, ROS arguments.
    """
    _, parent, folder, selection, *arguments = argv
    end_with_parent(int(parent))
    use_kernel_cache()
    names, *variants = selection.split(',')
    for variant in set(variants) & set(VARIANTS):
        VARIANTS[variant]()
    timers = [TIMERS[variant](Path(folder) / f'{names}.json')
              for variant in variants if variant in TIMERS]
    makers = [getattr(import_module(f'comply_ros.nodes.{name}'), MAKERS[name])
              for name in names.split('+')]
    times = StepTimes(Path(folder))
    if 'grid_world' in names:
        setattr(WorldMachine, 'on_action', recorded(WorldMachine.on_action, times.record))
    if len(makers) > 1:
        spin_together(makers, arguments)
    else:
        spin.run_node(makers[0], [names, *arguments], ())
    if 'grid_world' in names:
        times.write()
    for timer in timers:
        timer.write()
    return 0


if __name__ == '__main__':
    sys.exit(main(sys.argv))
