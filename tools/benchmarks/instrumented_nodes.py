# SPDX-License-Identifier: Apache-2.0
"""Our nodes, as they are but for one choice that a user could make otherwise, and a clock."""

from importlib import import_module
from pathlib import Path
import sys

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.experimental import EventsExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions

from comply_ros.nodes import cost_throttle, spin, topics
from comply_ros.protocol.grid_world import GridWorld
from comply_ros.protocol.messages import StateReward
from comply_ros.storage.kernel_cache import use_kernel_cache
from comply_ros.terminal.interrupts import end_with_parent, interrupts
from tools.benchmarks.callback_timer import Stopwatch
from tools.benchmarks.step_times import Stamps

CLASSES = {'grid_world': 'GridWorld', 'mentor': 'Mentor', 'learner': 'Learner'}
LOOP = ('STATE', 'RECOMMENDATION', 'ACTION')


def use_the_default_executor():
    """Change how nodes spin: as `rclpy.spin` does."""
    spin.EventsExecutor = SingleThreadedExecutor


def use_best_effort():
    """Change the three topics of the loop: what is lost is not sent again, nothing is latched."""
    qos = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT,
                     durability=DurabilityPolicy.VOLATILE)
    for name in LOOP:
        setattr(topics, name, getattr(topics, name)._replace(qos=qos))


def use_maps_at_any_cost():
    """Change when maps over all states come: whatever the last ones have cost."""
    cost_throttle.TIMES = 0


CHOICES = {'default_executor': use_the_default_executor, 'best_effort': use_best_effort,
           'maps_at_any_cost': use_maps_at_any_cost}


def timed(hear, note):
    """Return hear as a world calls it, that notes the steps and beginnings it brings about."""
    def on_action(self, msg):
        outputs = hear(self, msg)
        if outputs and type(outputs[-1]) is StateReward:
            note(outputs[-1].step == 0)
        return outputs
    return on_action


def spin_together(makers, argv):
    """Spin several nodes on one executor until they are interrupted."""
    with interrupts() as stop:
        rclpy.init(args=argv, signal_handler_options=SignalHandlerOptions.NO)
        executor, nodes = EventsExecutor(), [make() for make in makers]
        for node in nodes:
            executor.add_node(node)
        while not stop.is_set():
            executor.spin_once(timeout_sec=spin.POLL_PERIOD)
        rclpy.try_shutdown()


def main(argv):
    """Run nodes; return the exit code. argv: name, parent, folder, NODE+NODE,CHOICE, ROS."""
    _, parent, folder, words, *arguments = argv
    end_with_parent(int(parent))
    use_kernel_cache()
    names, *choices = words.split(',')
    for choice in set(choices) & set(CHOICES):
        CHOICES[choice]()
    stopwatch = Stopwatch(Path(folder), names) if 'profiled' in choices else None
    makers = [getattr(import_module(f'comply_ros.nodes.{name}'), CLASSES[name])
              for name in names.split('+')]
    stamps = Stamps(Path(folder))
    if 'grid_world' in names:
        GridWorld.on_action = timed(GridWorld.on_action, stamps.note)
    if len(makers) > 1:
        spin_together(makers, arguments)
    else:
        spin.run_node(makers[0], [names, *arguments], ())
    if 'grid_world' in names:
        stamps.write()
    if stopwatch:
        stopwatch.write()
    return 0


if __name__ == '__main__':
    sys.exit(main(sys.argv))
