# SPDX-License-Identifier: Apache-2.0
"""The node with which a person is the mentor at a terminal, by single keys."""

from contextlib import suppress
import signal

from rclpy.logging import LoggingSeverity

from comply_ros.mentor.mentor_policies import MentorError
from comply_ros.nodes.human_mentor import HumanMentorNode
from comply_ros.nodes.parameters import MENTOR, MENTOR_SEED, ParameterError, POLICY_FILE
from comply_ros.nodes.spin import run_node
from comply_ros.nodes.topics import TRUST
from comply_ros.storage.mentor_cache import read_mentor_spec
from comply_ros.storage.state_store import StateError
from comply_ros.terminal.ansi_map import map_lines
from comply_ros.terminal.raw_terminal import Terminal, TerminalError
from comply_ros.world.grid import NO_ACTION, STEPS

WORDS = ('left', 'right', 'down', 'up')
LETTERS = dict(zip('adsw', range(4)))
BLANK = ' '
SHARE = 0.1  # of the states that a key spoils
BANNER = """\
Teach the robot. You are its mentor; what it asks, you answer.
  arrows, w a s d   steering: where to go from @   painting: arrows move, w a s d paint
  space             no advice                       tab  steering or painting
  o  save policy    x  spoil a tenth of it          q  quit"""
HINT = ('(The learner waits for you in every step if its remembers_advice is false, else only '
        'where you said nothing yet.)')


class TeleopMentorNode(HumanMentorNode):
    """
    A mentor whose person sits at a terminal.

    Parameters
    ----------
    terminal: the `Terminal`; it is opened here, and closed at the end.

    """

    def __init__(self, terminal, **kwargs):
        super().__init__(**kwargs)
        self.get_logger().set_level(LoggingSeverity.ERROR)  # the page says the rest
        self._spec = self.declare(MENTOR._replace(default='none'))
        read_mentor_spec(self._spec)  # what cannot be is said before the page is there
        self._mentor_seed, self._file = self.declare(MENTOR_SEED), self.declare(POLICY_FILE)
        self._trust, self._cursor, self._remark, self._begun = None, None, '', False
        self.steering = True
        self.subscribe(TRUST, self._on_trust)
        self.create_timer(0.02, self._read_keys)
        self.create_timer(0.1, self._draw)
        self.create_timer(2.0, terminal.show_again)
        self._terminal = terminal
        terminal.open()

    def leave(self):
        """Leave the terminal as it was found: the node ends."""
        self._terminal.close()
        super().leave()

    def press(self, key):
        """Do what a key stands for, and remember what to say about it."""
        try:
            self._remark = self._do(key) or ''
        except ValueError as error:
            self._remark = str(error)

    def page(self, columns, rows):
        """Return the lines that are shown in so many columns and rows."""
        head = [*BANNER.splitlines(), HINT, '', *self._words(), '']
        head = [line[:columns] for line in head][:max(0, rows - 3)]
        if self.policy is None:
            return head
        grid, robot = self.actor.world.grid, self.actor.robot
        return head + map_lines(grid, self.policy, self._trust_here(), robot and robot.state,
                                None if self.steering else self._place(), columns,
                                rows - len(head))

    def _do(self, key):
        if key == 'q':
            signal.raise_signal(signal.SIGINT)
            return 'quits'
        if key in '\tm':
            self.steering = not self.steering
            self._cursor = None
            return None
        if key == 'o':
            self.save(self._file)
            return f'saved to {self._file}'
        if key == 'x':
            self.spoil(SHARE)
            return 'a tenth is spoiled'
        if key in WORDS and not self.steering:
            return self._move(WORDS.index(key))
        action = {**LETTERS, **dict(zip(WORDS, range(4))), BLANK: NO_ACTION}.get(key)
        return None if action is None else self._advise(action)

    def _advise(self, action):
        word = 'no advice' if action == NO_ACTION else WORDS[action]
        if self.steering:
            return f'you said {word}' if self.steer(action) else 'the robot does not wait'
        if self.policy is None:
            return 'waits for a world'
        self.paint({self._place(): action})
        return f'painted {word}'

    def _place(self):
        """State that the person paints: where the robot was when painting began, then as moved."""
        if self._cursor is None or self._cursor >= len(self.policy):
            robot = self.actor.robot
            self._cursor = robot.state if robot else self.actor.world.grid.starts[0]
        return self._cursor

    def _move(self, action):
        if self.policy is None:
            return 'waits for a world'
        grid = self.actor.world.grid
        x, y = (a + b for a, b in zip(grid.place(self._place()), STEPS[action]))
        if 0 <= x < grid.width and 0 <= y < grid.height:
            self._cursor = y * grid.width + x
        return None

    def _on_trust(self, msg):
        """Take the confidence in every state, if it is of the world that is here."""
        world = self.actor.described
        if world and msg.run == world.run and len(msg.confidence) == world.width * world.height:
            self._trust = msg.run, msg.confidence
        return ()

    def _read_keys(self):
        try:
            keys = self._terminal.keys()
        except EOFError:
            keys = ['q']
        for key in keys:
            self.press(key)

    def _draw(self):
        if self.policy is not None and not self._begun:
            self._begun = True
            self._begin()
        with suppress(OSError):  # it hung up: the next look at the keys finds out
            self._terminal.show(self.page(*self._terminal.size()))

    def _begin(self):
        """Begin with the policy that was asked for."""
        if self._spec != 'none':
            self._remark = f'making {self._spec} ...'
            self.begin_from(self._spec, self._mentor_seed).add_done_callback(self._tell_begun)

    def _tell_begun(self, future):
        self._remark = str(future.exception() or f'begins as {self._spec}')

    def _words(self):
        """Return how it is, in two or three lines."""
        waits, robot, left = self.actor.waiting_for(), self.actor.robot, self.seconds_left
        yield (f'mode: {"steering" if self.steering else "painting"}'
               + (f'   waits for {waits}' if waits else ''))
        if robot:
            advised = sum(action != NO_ACTION for action in self.policy.tolist())
            yield (f'robot in state {robot.state}, step {robot.step} of episode {robot.episode}'
                   + (f'; it waits for you, {left:.1f} s' if left is not None else '')
                   + f'   {self._trust_in_words(robot.state)}   arrows: {advised}')
        yield self._remark

    def _trust_here(self):
        """Return the confidence in every state, None where it is not known in this run."""
        return self._trust[1] if self._trust and self._trust[0] == self.actor.described.run \
            else None

    def _trust_in_words(self, state):
        confidence = self._trust_here()
        if confidence is None:
            return 'trust in you: not known yet'
        advised = [trust for trust, action in zip(confidence, self.policy.tolist())
                   if action != NO_ACTION]
        mean = f', {sum(advised) / len(advised):.2f} where you advise' if advised else ''
        return f'trust in you: {confidence[state]:.2f} here{mean}'

    def _warn(self, msg):
        super()._warn(msg)
        self._remark = f'refused: {msg.reason}'

    def _tell(self, msg):
        super()._tell(msg)
        self._remark = msg.text


def main(argv):
    """Run the node; return the exit code."""
    return run_node(lambda: TeleopMentorNode(Terminal()), argv,
                    (ParameterError, MentorError, StateError, TerminalError))
