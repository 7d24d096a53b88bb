# SPDX-License-Identifier: Apache-2.0
"""Channels of a check to machines in this process, by a clock that does not wait."""

from collections import defaultdict

from comply_ros.protocol.messages import Action, LearnerDescription, Policy, WorldDescription
from comply_ros.protocol.rule_report import Received

RECEIVED = ('StateReward', 'WorldDescription', 'Episode', 'Recommendation', 'Policy', 'Action',
         'LearnerDescription', 'Progress')
FIRST_PAUSE, LONGEST_PAUSE = 0.02, 5.0  # as those of the node


class MachineChannel:
    """
    Gives messages to a machine and collects its outputs.

    change: called with each output; returns the outputs that are published instead, so that a
        test can break one rule.
    """

    def __init__(self, machine, change=lambda msg: (msg,)):
        self.machine, self._change, self.time = machine, change, 0.0
        self.received = defaultdict(list)

    def publish(self, outputs):
        for each in outputs:
            for msg in self._change(each) if type(each).__name__ in RECEIVED else ():
                self.received[type(msg).__name__].append(Received(self.time, msg))

    def wait(self, condition, seconds):
        if not condition():
            self.time += seconds
        return bool(condition())

    def reset(self):
        return False


class WorldChannel(MachineChannel):
    """To a `GridWorld`, which repeats its observation as the node does."""

    def __init__(self, machine, change=lambda msg: (msg,)):
        super().__init__(machine, change)
        self._restart()
        self.publish(machine.last_outputs())

    def _restart(self):
        self._since, self._pause, self._next = self.time, FIRST_PAUSE, self.time + FIRST_PAUSE

    def send(self, msg):
        if isinstance(msg, WorldDescription):
            self.publish(self.machine.on_world(msg, self.time))
            return
        before = self.machine.observation, self.machine.learner_messages
        self.publish(self.machine.on_action(msg))
        if (self.machine.observation, self.machine.learner_messages) != before:
            self._restart()

    def wait(self, condition, seconds):
        end = self.time + seconds
        while not condition() and self._next <= end:
            self.time = self._next
            self.publish(self.machine.repeat(self.time - self._since))
            self._pause = min(2.0 * self._pause, LONGEST_PAUSE)
            self._next = self.time + self._pause
        if not condition():
            self.time = end
        return bool(condition())

    def reset(self):
        self.publish(self.machine.reset(self.machine.description.run + 5, 0))
        self._restart()
        return True


class MentorChannel(MachineChannel):
    """To a `Mentor` that advises by a policy."""

    def __init__(self, machine, policy, change=lambda msg: (msg,)):
        super().__init__(machine, change)
        self._policy = policy

    def send(self, msg):
        if isinstance(msg, WorldDescription):
            before = self.machine.tracker.run
            try:
                self.publish(self.machine.on_world(msg))
            except ValueError:
                return
            if self.machine.tracker.run != before:
                self.publish(self.machine.use(self._policy))
                self.publish((Policy(msg.run, self._policy.tolist()),))
        elif isinstance(msg, Action):
            self.publish(self.machine.on_action(msg))
        else:
            self.publish(self.machine.observe(msg))


class LearnerChannel(MachineChannel):
    """To a `Learner`, which is described before its first action in a run."""

    def send(self, msg):
        if isinstance(msg, WorldDescription):
            before = self.machine.tracker.run
            try:
                outputs = self.machine.on_world(msg)
            except ValueError:
                return
            if self.machine.tracker.run != before:
                self.publish((LearnerDescription(
                    msg.run, self.machine.number, 0, 'sarsa', '{}', 0, True, ''),))
            self.publish(outputs)
        elif type(msg).__name__ == 'Recommendation':
            self.publish(self.machine.on_recommendation(msg))
        else:
            self.publish(self.machine.observe(msg))
