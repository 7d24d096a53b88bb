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
    Gives messages to a machine and collects its outputs; once a second the machine has its tick.

    change: called with each output; returns the outputs that are published instead, so that a
        test can break one rule.
    make: returns a machine for a seed, where it can be started again.
    """

    def __init__(self, machine, change=lambda msg: (msg,), make=None):
        self.machine, self._change, self._make, self.time = machine, change, make, 0.0
        self.received, self.transcript = defaultdict(list), []
        self.last_run, self.followed, self._next_tick = 100, 0, 1.0

    def publish(self, outputs):
        for each in outputs:
            for msg in self._change(each) if type(each).__name__ in RECEIVED else ():
                self.received[type(msg).__name__].append(Received(self.time, msg))
                self.transcript.append(self.received[type(msg).__name__][-1])

    def send(self, msg):
        self.transcript.append(Received(self.time, msg))
        self.receive(msg)

    def wait(self, condition, seconds):
        end = self.time + seconds
        while not condition() and self._next_tick <= end:
            self.time, self._next_tick = self._next_tick, self._next_tick + 1.0
            self.tick()
        if not condition():
            self.time = end
        return bool(condition())

    def tick(self):
        self.publish(self.machine.tick())

    def reset(self):
        return False

    def restart(self, seed):
        if self._make is None:
            return False
        self.machine = self._make(seed)
        return True

    def digest(self):
        return None


class WorldChannel(MachineChannel):
    """To a `WorldMachine`, which repeats its observation as the node does."""

    def __init__(self, machine, change=lambda msg: (msg,), make=None, resets=True):
        super().__init__(machine, change, make)
        self._resets = resets
        self.restart_pauses()
        self.publish(machine.last_outputs())

    def restart_pauses(self):
        self._since, self._pause, self._next = self.time, FIRST_PAUSE, self.time + FIRST_PAUSE

    def receive(self, msg):
        if isinstance(msg, WorldDescription):
            self.publish(self.machine.on_world(msg, self.time))
            return
        before = self.machine.observation, self.machine.learner_messages
        self.publish(self.machine.on_action(msg))
        if (self.machine.observation, self.machine.learner_messages) != before:
            self.restart_pauses()

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
        if self._resets:
            self.publish(self.machine.reset(self.machine.description.run + 5, 0))
            self.restart_pauses()
        return self._resets

    def restart(self, seed):
        if not super().restart(seed):
            return False
        self.restart_pauses()
        self.publish(self.machine.last_outputs())
        return True


class MentorChannel(MachineChannel):
    """To a `Mentor` that advises by a policy."""

    def __init__(self, machine, policy, change=lambda msg: (msg,)):
        super().__init__(machine, change)
        self._policy, self._used = policy, None

    def receive(self, msg):
        if isinstance(msg, WorldDescription):
            try:
                self.publish(self.machine.on_world(msg))
            except ValueError:
                return
            self._follow()
        elif isinstance(msg, Action):
            self.publish(self.machine.on_action(msg))
        else:
            self.publish(self.machine.observe(msg))

    def tick(self):
        super().tick()
        self._follow()

    def _follow(self):
        """Do as the node in a new run: publish the policy, made anew in another world."""
        run = self.machine.tracker.run
        if run == self._used or run is None:
            return
        self._used = run
        self.publish((Policy(run, self._policy.tolist()),))
        self.publish(self.machine.use(self._policy) if self.machine.policy is None
                     else self.machine.release_held())


class LearnerChannel(MachineChannel):
    """To a `Learner`, which is described before its first action in a run."""

    def __init__(self, machine, change=lambda msg: (msg,), make=None, resets=True):
        super().__init__(machine, change, make)
        self._resets, self._described = resets, None

    def receive(self, msg):
        if isinstance(msg, WorldDescription):
            try:
                self._publish_described(self.machine.on_world(msg))
            except ValueError:
                return
        elif type(msg).__name__ == 'Recommendation':
            self.publish(self.machine.on_recommendation(msg))
        else:
            self.publish(self.machine.observe(msg))

    def tick(self):
        self._publish_described(self.machine.tick())

    def _publish_described(self, outputs):
        run = self.machine.tracker.run
        if run not in (None, self._described):
            self._described = run
            self.publish((LearnerDescription(
                run, self.machine.number, 0, 'sarsa', '{}', 0, True, ''),))
        self.publish(outputs)

    def reset(self):
        if self._resets:
            self.publish(self.machine.reset())
        return self._resets

    def digest(self):
        return self.machine.state.digest()
