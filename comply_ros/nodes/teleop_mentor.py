# SPDX-License-Identifier: Apache-2.0
"""The node of a human mentor at a terminal, who advises by single keys."""

from collections.abc import Iterator, Sequence
from concurrent.futures import Future
from contextlib import suppress
import signal
from typing import Any

import numpy as np
from rclpy.logging import LoggingSeverity

from comply_ros.mentor.mentor_spec import MentorError
from comply_ros.nodes.clocks import steady_timer
from comply_ros.nodes.human_mentor import HumanMentorNode
from comply_ros.nodes.parameters import MENTOR, MENTOR_SEED, ParameterError, POLICY_FILE
from comply_ros.nodes.spin import run_node
from comply_ros.nodes.topics import TRUST
from comply_ros.protocol.messages import Notice, Rejected, Trust
from comply_ros.storage.checkpoint_store import StateError
from comply_ros.storage.mentor_cache import read_mentor_spec
from comply_ros.terminal.ansi_map import map_lines
from comply_ros.terminal.raw_terminal import Terminal, TerminalError, wrapped, wrapped_items
from comply_ros.world.grid import NO_ACTION, STEPS

DIRECTIONS = ('left', 'right', 'down', 'up')  # by action; also the names of the arrow keys
ACTIONS = {**dict(zip(DIRECTIONS, range(4))), **dict(zip('adsw', range(4))), ' ': NO_ACTION}
TITLE = 'You are the mentor of the robot (@). Mode: '
COMMON_KEYS = ('o  save the policy', 'x  randomize a tenth of it', 'q  quit')
STEERING_KEYS = ('arrows, w a s d  where to go', 'space  no advice', 'tab  paint instead',
                 *COMMON_KEYS)
PAINTING_KEYS = ('arrows  move the cursor', 'w a s d  paint', 'space  erase',
                 'tab  steer instead', *COMMON_KEYS)
STEERING_NOTE = ("The robot waits for you in every step if the learner's remembers_advice is "
                 'false, otherwise only in states for which you have given no advice yet.')
NO_GRID = 'The keys advise in grids only.'


class TeleopMentorNode(HumanMentorNode):
    """A human mentor at a terminal, which is opened here, and closed by `leave`."""

    def __init__(self, terminal: Terminal, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.get_logger().set_level(LoggingSeverity.ERROR)  # the page shows the rest
        self._spec = self.declare(MENTOR._replace(default='none'))
        read_mentor_spec(self._spec)  # an error is printed before the page opens
        self._mentor_seed, self._file = self.declare(MENTOR_SEED), self.declare(POLICY_FILE)
        self._trust: Trust | None = None
        self._cursor: int | None = None
        self._remark, self._started = '', False
        self.steering = True
        self.subscribe(TRUST, self._on_trust)
        steady_timer(self, 0.02, self._read_keys)
        steady_timer(self, 0.1, self._draw)
        steady_timer(self, 2.0, terminal.redraw)
        self._terminal = terminal
        terminal.open()

    def leave(self) -> None:
        """Restore the terminal: the node ends."""
        self._terminal.close()
        super().leave()

    def press(self, key: str) -> None:
        """Do what a key stands for; the page shows the result or what was wrong."""
        try:
            self._remark = self._do(key)
        except ValueError as error:
            self._remark = str(error)

    def page(self, columns: int, rows: int) -> list[str]:
        """Return the lines of the page, for a terminal of this size."""
        texts = [STEERING_NOTE] if self.steering else []
        head = [*wrapped(TITLE + ('steering' if self.steering else 'painting'), columns),
                *wrapped_items(STEERING_KEYS if self.steering else PAINTING_KEYS, columns),
                *(line for text in (*texts, '', *self._status_lines(), '')
                  for line in wrapped(text, columns))][:max(0, rows - 3)]
        if self.policy is None:
            return head
        world = self._known()[1]
        if self._has_other_actions():
            return head + wrapped(f'The world is no grid: it has {world.n_states} states and no '
                                  'map to show. ' + NO_GRID, columns)
        robot, cursor = self.machine.robot, None if self.steering else self._cursor_state()
        return head + map_lines(world.grid, self.policy, self._confidence(),
                                robot and robot.state, cursor, columns, rows - len(head),
                                self._terminal.has_color)

    def _do(self, key: str) -> str:
        """Do what a key stands for, and return the remark about it."""
        if key == 'q':
            signal.raise_signal(signal.SIGINT)
            return 'quitting'
        if key in '\tm':
            self.steering, self._cursor = not self.steering, None
        elif key == 'o':
            self.save(self._file)
            return f'saved to {self._file}'
        elif key == 'x':
            self.spoil(0.1)
            return 'a tenth of the states has random advice now'
        elif key in ACTIONS and self._has_other_actions():
            return NO_GRID
        elif key in ACTIONS and self.steering:
            if not self.steer(ACTIONS[key]):
                return 'the robot is not waiting for advice'
            return f'your advice: {"none" if key == " " else DIRECTIONS[ACTIONS[key]]}'
        elif key in ACTIONS and self.policy is None:
            return 'there is no world yet'
        elif key in DIRECTIONS:
            self._move_cursor(ACTIONS[key])
        elif key in ACTIONS:
            self.paint({self._cursor_state(): ACTIONS[key]})
            return 'erased' if key == ' ' else f'painted {DIRECTIONS[ACTIONS[key]]}'
        return ''

    def _has_other_actions(self) -> bool:
        """Whether there is a world whose actions are not those of the keys."""
        world = self.machine.world
        return world is not None and world.model != 'grid'

    def _cursor_state(self) -> int:
        """State under the cursor: that of the robot when painting began, then as moved."""
        (policy, world), robot = self._known(), self.machine.robot
        if self._cursor is None or self._cursor >= len(policy):
            self._cursor = robot.state if robot else world.grid.starts[0]
        return self._cursor

    def _move_cursor(self, action: int) -> None:
        grid = self._known()[1].grid
        x, y = (a + b for a, b in zip(grid.place(self._cursor_state()), STEPS[action]))
        if 0 <= x < grid.width and 0 <= y < grid.height:
            self._cursor = y * grid.width + x

    def _on_trust(self, msg: Trust) -> tuple[()]:
        """Keep the confidence in this mentor in every state of this world, in this run."""
        world = self.machine.tracker.description
        if world and msg.run == world.run and len(msg.confidence) == world.states \
                and msg.mentor == self.machine.name:
            self._trust = msg
        return ()

    def _confidence(self) -> Sequence[float] | None:
        """Return `p[s]`, None if it is not known in this run."""
        known = self._trust and self._trust.run == self.machine.tracker.run
        return self._trust.confidence if known else None

    def _read_keys(self) -> None:
        try:
            keys = self._terminal.read_keys()
        except EOFError:
            keys = ['q']
        for key in keys:
            self.press(key)

    def _draw(self) -> None:
        if self.policy is not None and not self._started:
            self._started = True
            if self._spec != 'none':
                self._remark = f'making {self._spec} ...'
                self.begin_from(self._spec, self._mentor_seed).add_done_callback(self._made)
        with suppress(OSError):  # the terminal is gone: `_read_keys` finds out
            self._terminal.show(self.page(*self._terminal.size()))

    def _made(self, future: Future) -> None:
        self._remark = str(future.exception() or f'your policy starts as {self._spec}')

    def _status_lines(self) -> Iterator[str]:
        missing, robot, left = self.waiting_for(), self.machine.robot, self.seconds_left
        if missing:
            yield f'waits for {missing}'
        if robot:
            advised = np.flatnonzero(self.policy != NO_ACTION)
            yield (f'robot in state {robot.state}, step {robot.step} of episode {robot.episode}'
                   + (f'; it waits for you, {left:.1f} s' if left is not None else ''))
            confidence, trust = self._confidence(), 'not known yet'
            if confidence is not None:
                trust = f'{confidence[robot.state]:.2f} here'
                if len(advised):
                    mean = np.asarray(confidence)[advised].mean()
                    trust += f', {mean:.2f} where you advise'
            count = f'{len(advised)} state' + ('' if len(advised) == 1 else 's')
            yield f'trust in you: {trust}; advice in {count}'
        yield self._remark

    def _log_rejected(self, output: Rejected) -> None:
        super()._log_rejected(output)
        self._remark = f'rejected: {output.reason}'

    def _log_notice(self, output: Notice) -> None:
        super()._log_notice(output)
        self._remark = output.text


def main(argv: list[str]) -> int:
    """Run the node; return the exit code."""
    return run_node(lambda: TeleopMentorNode(Terminal()), argv,
                    (ParameterError, MentorError, StateError, TerminalError))
