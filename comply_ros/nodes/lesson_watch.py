# SPDX-License-Identifier: Apache-2.0
"""A lesson from its first message to its results: who takes part, who dies, what was learned."""

from collections.abc import Callable
import time
from typing import Any

from comply_msgs.srv import Save
from numpy.typing import NDArray
from rclpy.executors import SingleThreadedExecutor

from comply_ros.learner.learning_result import LearningError
from comply_ros.nodes.run_monitor import LessonFailed, RunMonitor
from comply_ros.nodes.spin import POLL_PERIOD
from comply_ros.nodes.topics import ANOTHER
from comply_ros.storage.learning_file import read_learning
from comply_ros.storage.mentor_cache import mentor_policy
from comply_ros.terminal.interrupts import check, StopFlag
from comply_ros.terminal.training_options import TrainingOptions
from comply_ros.world.mdp import World

SAVE_TIMEOUT = 10.0  # seconds after which a learner that does not answer is asked again to save
OTHER_MENTORS = ('another mentor publishes: the learner uses the advice of both, and the same '
                 'options need not give the same bits')
TAKEN = ('other nodes publish on the topics of this lesson: end them, or give this one a '
         '--namespace of its own')


class LessonWatch:
    """
    Watches the nodes of a lesson until the learner has finished and saved.

    Parameters
    ----------
    options: of the lesson.
    monitor, executor: the node that receives what the others publish, and what spins it.
    stop: whether to end early.
    show: called with the text of the status. show_line: with a line that stays.

    """

    def __init__(self, options: TrainingOptions, monitor: RunMonitor,
                 executor: SingleThreadedExecutor, stop: StopFlag,
                 show: Callable[[str], Any], show_line: Callable[[str], Any]) -> None:
        self._options, self._monitor, self._executor = options, monitor, executor
        self._stop, self._show, self._show_line = stop, show, show_line
        self._respawn, self._needs_mentor = options.args.respawn, options.config.needs_mentor()
        self._file = (options.out / 'learning.npz').resolve()
        self._others = 0  # most mentors besides that of the lesson, at one time

    def outcome(self) -> tuple[NDArray[Any] | None, dict[str, Any]]:
        """
        Return the mentor's advice and the outcome, when the learner has finished and saved.

        The advice is None where an external mentor did not publish it, and the digest in the
        outcome where an external learner does not save.

        Raises
        ------
        NodeDied, LessonFailed: if there is no outcome.

        """
        options, monitor = self._options, self._monitor
        self._spin_until(lambda: monitor.finished and (self._respawn or monitor.own_run_known))
        seconds, digest = monitor.seconds(), self._digest()
        advice = monitor.advice
        if self._others and options.args.external != 'mentor':  # any of them may have published
            advice = mentor_policy(options.spec, World(options.source), options.mentor_seed)
        return advice, {
            'seed': options.seed, 'returns': [msg.mean_return for msg in monitor.progress],
            'confidences': monitor.confidences(),
            'steps': monitor.progress[-1].steps, 'wall_seconds': seconds,
            'digest': digest, 'other_mentors': self._others}

    def _digest(self) -> str | None:
        """Return the digest of what the learner saved; None where an external one did not."""
        is_external = self._options.args.external == 'learner'
        if is_external and not self._monitor.can_save:
            return None
        response = self._save()
        problem = '' if response.success else f'could not save: {response.message}'
        if is_external and not problem:
            try:
                read_learning(self._file).validate(World(self._options.source))
            except LearningError as error:
                problem = f'did not save what it learned: {error}'
        if problem and not is_external:
            raise LessonFailed(f'the learner {problem}')
        if problem:
            self._show_line(f'lesson: the external learner {problem}')
        return None if problem else response.digest

    def _save(self) -> Save.Response:
        """Ask the learner to save until it has answered; return its answer."""
        response = None
        while response is None or response.message.startswith(ANOTHER):  # of another learner
            future = self._monitor.save(self._file)
            end = time.monotonic() + SAVE_TIMEOUT  # it may have been killed meanwhile
            self._spin_until(lambda: future.done() or time.monotonic() > end)
            response = future.result()
        return response

    def _spin_until(self, is_reached: Callable[[], bool]) -> None:
        """Spin until a condition holds; raises what ends a lesson early."""
        monitor = self._monitor
        while not is_reached():
            check(self._stop)
            found_late = not monitor.progress and monitor.most_publishers() > 1
            if not self._respawn and (found_late or monitor.follows_another_world):
                raise LessonFailed(TAKEN)  # they were there before
            self._check_processes()
            self._executor.spin_once(timeout_sec=POLL_PERIOD)
            self._note_other_mentors()
            if monitor.unwell:
                self._show('; '.join(monitor.unwell.values()))

    def _check_processes(self) -> None:
        """Start killed nodes again if that is wanted; raise NodeDied otherwise."""
        for process in self._monitor.processes:
            if not self._respawn:
                process.check()
            elif process.respawn():
                self._show(f'{process.name} was killed and starts again')

    def _note_other_mentors(self) -> None:
        """Count other mentors, and say once that there are some."""
        found = self._monitor.other_mentors(self._respawn) if self._needs_mentor else 0
        if found > 0 and not self._others:
            self._show_line(f'lesson: {OTHER_MENTORS}')
        self._others = max(self._others, found)
