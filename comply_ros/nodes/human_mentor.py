# SPDX-License-Identifier: Apache-2.0
"""A mentor node whose advice a person gives while it runs, on a page or at a terminal."""

from collections.abc import Callable, Mapping
from concurrent.futures import Future
from pathlib import Path
from queue import Empty, SimpleQueue
import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from comply_ros.mentor.mentor_policies import spoiled_policy
from comply_ros.mentor.mentor_spec import MentorError
from comply_ros.mentor.policy_validation import PolicyError
from comply_ros.nodes.background_thread import in_background
from comply_ros.nodes.clocks import PaceClock, steady_timer
from comply_ros.nodes.mentor import advertise_mentor, declare_name, policy_message
from comply_ros.nodes.parameters import PATIENCE, STATE_DIR
from comply_ros.nodes.protocol_node import ProtocolNode
from comply_ros.nodes.topics import STATE, WORLD
from comply_ros.protocol.human_mentor import HumanMentor
from comply_ros.protocol.message_validation import rejected_description
from comply_ros.protocol.messages import Outputs, StateReward, WorldDescription
from comply_ros.storage.mentor_cache import mentor_policy, read_mentor_spec
from comply_ros.storage.painting_store import PaintingStore
from comply_ros.storage.policy_files import read_policy, write_policy
from comply_ros.world.mdp import World

MAP_PERIOD = 0.1  # seconds between two messages on `mentor_policy`, at least
POLL_PERIOD = 0.02  # seconds between two checks of what waits


class HumanMentorNode(ProtocolNode):
    """
    Recommends what a person paints or steers; gives no advice at first.

    Call all methods but `do` in the thread that spins the node. Those that need a world raise
    ValueError before there is one, and for what cannot be, with a sentence for the person. A
    learner that remembers advice waits for a person only in states without earlier advice.
    """

    machine: HumanMentor

    def __init__(self, **kwargs: Any) -> None:
        super().__init__('mentor', **kwargs)
        self.machine = HumanMentor(declare_name(self))
        self._patience, self._pace = self.declare(PATIENCE), PaceClock(self)
        self._open: StateReward | None = None  # the observation that waits for the person
        self._since = 0.0
        self._published_run: int | None = None
        self._has_changed, self._published = False, float('-inf')
        self._stored = _StoredPainting(self, self.get_parameter(STATE_DIR.name).value)
        self._calls: SimpleQueue[tuple[Future, Callable[[], Any]]] = SimpleQueue()
        advertise_mentor(self)
        self.subscribe(WORLD, self.on_world)
        self.subscribe(STATE, self.machine.observe)
        self.on_parameters_set(self._set_patience)
        steady_timer(self, POLL_PERIOD, self._poll)

    @property
    def policy(self) -> NDArray[Any] | None:
        """`advice[s]`, not to be changed in place; None before there is a world."""
        return self.machine.current_policy

    @property
    def steering(self) -> bool:
        """Whether observations wait for the person; may be set."""
        return self.machine.steering

    @steering.setter
    def steering(self, wanted: bool) -> None:
        self.respond(self.machine.set_steering(bool(wanted)))

    @property
    def seconds_left(self) -> float | None:
        """Seconds that the robot still waits for the person; None where it does not wait."""
        if self.machine.waiting is None or self._open is not self.machine.waiting:
            return None
        return max(0.0, self._since + self._patience - self._pace.seconds())

    def do(self, function: Callable[[], Any]) -> Future:
        """Have the thread that spins this node call a function soon; for any thread."""
        future: Future = Future()
        self._calls.put((future, function))
        return future

    def paint(self, cells: Mapping[int, int]) -> None:
        """
        Change the advice in some states, from the next observation on.

        cells: actions by state; -1 for no advice. If one is invalid, nothing changes.
        """
        self.machine.edit(cells)
        self._publish_changed()

    def use(self, policy: NDArray[Any]) -> None:
        """Advise by `policy[s]`, from the next observation on."""
        self.machine.replace(policy)
        self._publish_changed()

    def erase(self) -> None:
        """Advise nothing anywhere."""
        self.use(np.full_like(self._known()[0], -1))

    def steer(self, action: int) -> bool:
        """Give advice for the observation that waits; return whether one did."""
        outputs = self.machine.steer(action)
        self.respond(outputs)
        if outputs:
            self._publish_changed()
        return bool(outputs)

    def load(self, path: str | Path) -> None:
        """Advise by a policy file."""
        self.use(read_policy(path, self._known()[1]))

    def save(self, path: str | Path) -> None:
        """Write the policy to a file."""
        write_policy(path, *self._known())

    def spoil(self, share: float, seed: int = 0) -> None:
        """Advise any action of the cell in a share of the states."""
        if not 0.0 <= share <= 1.0:
            raise MentorError(f'a share must lie in [0, 1], got {share}')
        generator = np.random.Generator(np.random.PCG64(seed))
        self.use(spoiled_policy(*self._known(), share, generator))

    def begin_from(self, spec: str, seed: int = 0) -> Future:
        """
        Advise as a generated mentor does, as soon as it is generated; some take seconds.

        spec: as the parameter `mentor` of a mentor node, such as 'noisy:0.2'.

        Return a future that is done when the mentor is used, or has an error for the person.
        """
        (_, world), used = self._known(), Future()
        in_background(mentor_policy, read_mentor_spec(spec), world, seed).add_done_callback(
            lambda generated: self._calls.put(
                (used, lambda: self._use_in(world, generated.result()))))
        return used

    def on_world(self, msg: WorldDescription) -> Outputs:
        """Return what to publish about a world, with the map of all advice in a new run."""
        try:
            outputs = self.machine.on_world(msg)
        except ValueError as error:
            return (rejected_description(error),)
        return self._with_map(outputs)

    def tick(self) -> Outputs:
        """Return what to publish if another world takes the place of this one now."""
        return self._with_map(super().tick())

    def leave(self) -> None:
        """Store what was painted; the node ends."""
        self._stored.close(self.machine)
        super().leave()

    def status_text(self) -> str:
        """Return the status while all is well."""
        return 'waits for the person' if self.machine.waiting else 'runs'

    def _known(self) -> tuple[NDArray[Any], World]:
        if self.policy is None or self.machine.world is None:
            raise PolicyError('a policy must be for a world, and none is known yet')
        return self.policy, self.machine.world

    def _with_map(self, outputs: Outputs) -> Outputs:
        world = self.machine.tracker.description
        if world is None or world.run == self._published_run:
            return outputs
        self._published_run = world.run
        self._stored.load_into(self.machine)
        return (policy_message(self.machine), *outputs)

    def _set_patience(self, values: dict[str, Any]) -> None:
        self._patience = values.get(PATIENCE.name, self._patience)

    def _publish_changed(self) -> None:
        self._has_changed = self._stored.has_changed = True
        self._publish_if_due()

    def _publish_if_due(self) -> None:
        now = time.monotonic()
        if self._has_changed and now - self._published >= MAP_PERIOD:
            self._has_changed, self._published = False, now
            self.respond((policy_message(self.machine),))

    def _poll(self) -> None:
        """Give no advice where patience ends, publish the map if it is due, make calls."""
        now, waiting = self._pace.seconds(), self.machine.waiting
        if waiting is not self._open or self.blocked:
            self._open, self._since = waiting, now
        elif waiting is not None and now - self._since >= self._patience:
            self.respond(self.machine.give_up())
        self._publish_if_due()
        self._stored.save_changed(self.machine)
        while True:
            try:
                future, function = self._calls.get_nowait()
            except Empty:
                return
            resolve(future, function)

    def _use_in(self, world: World, policy: NDArray[Any]) -> None:
        if world is not self.machine.world:
            raise PolicyError('a policy must be for the world that is here, and that one is gone')
        self.use(policy)


class _StoredPainting:
    """The painting of a node in its `state_dir`; without one, nothing is stored."""

    def __init__(self, node: ProtocolNode, folder: str) -> None:
        self._logger = node.get_logger()
        name = f'{node.get_fully_qualified_name().strip("/").replace("/", ".")}.painting'
        self._store = PaintingStore(folder, name) if folder else None
        self.has_changed = False  # what was painted, since it was stored
        self._sha256 = ''  # of the map whose painting was loaded
        self._saving: Future | None = None

    def load_into(self, machine: HumanMentor) -> None:
        """Advise by what was stored for a new world; a damaged file stays as it is."""
        if self._store is None or machine.world is None \
                or machine.world.sha256 == self._sha256:
            return
        self._sha256 = machine.world.sha256
        try:
            policy = self._store.load(machine.world)
            if policy is not None:
                machine.replace(policy)
        except PolicyError as error:
            self._logger.error(f'{error}: nothing that is painted is stored; move '
                               f'{str(self._store.path(machine.world))!r} away and start again')
            self._store.close()
            self._store = None

    def save_changed(self, machine: HumanMentor) -> None:
        """Store what has changed, in the background; the next change waits for it."""
        if self._store is None or self._saving and not self._saving.done():
            return
        if self._saving and (error := self._saving.exception()):
            self._logger.error(f'{error}: tries again', throttle_duration_sec=10.0)
            self.has_changed = True
        self._saving = None
        if self.has_changed and machine.current_policy is not None and machine.world is not None:
            self.has_changed = False
            self._saving = in_background(self._store.save, machine.current_policy, machine.world)

    def close(self, machine: HumanMentor) -> None:
        """Store what has changed, now."""
        if self._store is None:
            return
        if self._saving:
            self._saving.exception()  # waits for it
        self.save_changed(machine)
        if self._saving and (error := self._saving.exception()):
            self._logger.error(str(error))
        self._store.close()
        self._store = None


def resolve(future: Future, function: Callable[[], Any]) -> None:
    """Change a `Future` into what a call returns or raises."""
    try:
        future.set_result(function())
    except Exception as error:  # noqa: BLE001 - whoever asks for the result gets it
        future.set_exception(error)
