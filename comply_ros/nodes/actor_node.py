# SPDX-License-Identifier: Apache-2.0
"""What the three nodes share: to listen, to keep, to say, and to tell how they are."""

from rclpy.exceptions import InvalidParameterTypeException

from comply_ros.core.dialogue import Aside, Dropped, Notice, Refused
from comply_ros.nodes.health import ERROR, Health, OK, STANDS_ASIDE, WARN
from comply_ros.nodes.parameters import (
    declare,
    ParameterError,
    STATE_DIR,
    SturdyNode,
    unknown_overrides,
)
from comply_ros.nodes.strangers import Strangers
from comply_ros.nodes.topics import decoder, encoder, RECOMMENDATION
from comply_ros.session.keeping import Keeper

PATIENCE = 3  # seconds of waiting after which a node says for what
AGAIN = 0.2  # seconds between two tries to keep what the disk did not take


class ActorNode(SturdyNode):
    """
    A node that keeps what its actor was told, then says what it returns.

    Attributes
    ----------
    actor: the state machine of core that this node is a shell of.
    health: counts of what was refused and dropped.
    keeper: the `Keeper` of its state, None where nothing is kept.
    mistake: an exception that a callback found; it ends the node.

    """

    def __init__(self, name, **kwargs):
        try:
            super().__init__(name, **kwargs)
        except InvalidParameterTypeException as error:  # of the parameters that every node has
            raise ParameterError(f'a parameter must be of its type: {error}') from None
        self.actor, self.keeper, self.mistake = None, None, None
        self.health, self._strangers = Health(self), Strangers(self)
        self._state_dir = self.declare(STATE_DIR)
        self._ends, self._services_of_ours = [], []
        self._unsaid, self._trouble, self._aside = None, None, None
        self._waited = None, 0
        self._voices = {Refused: self._warn, Dropped: self._drop, Notice: self._tell,
                        Aside: self._stand_aside}
        self._retry = self.create_timer(AGAIN, self._try_again)
        self._retry.cancel()
        self.create_timer(1.0, self._look)
        for unknown in unknown_overrides(self):
            self.get_logger().warning(f'parameter {unknown!r} is unknown and has no effect')

    def declare(self, parameter):
        """Declare a parameter and return its value; raises ParameterError."""
        return declare(self, parameter)

    def speaks_on(self, topic):
        """Make a publisher: tuples of the topic's kind that are said go there."""
        publisher, encode = self.create_publisher(topic.message, topic.name, topic.qos), \
            encoder(topic)
        publish = publisher.publish
        self._ends.append(publisher)
        self._voices[topic.said] = lambda said: publish(encode(said))
        self._strangers.watch(topic)

    def serves(self, kind, name, reply):
        """Make a service."""
        self._services_of_ours.append(self.create_service(kind, name, reply))

    def listens_to(self, topic, hear):
        """Subscribe: every message on the topic is decoded, heard, and answered."""
        decode = decoder(topic)

        def take(message):
            if self._unsaid is None:  # while it pauses; what is not heard now is said again
                self.answer(hear(decode(message)))
        self.create_subscription(topic.message, topic.name, take, topic.qos)
        self._strangers.watch(topic, has_one_speaker=topic is RECOMMENDATION)

    def recall(self, identity, kinds):
        """
        Return what was kept in `state_dir`, None where nothing was; from now on it is kept there.

        Raises
        ------
        StateError: if it cannot be gone on from.

        """
        if not self._state_dir:
            return None
        name = self.get_fully_qualified_name().strip('/').replace('/', '.')
        self.keeper = Keeper(self._state_dir, name, identity, kinds)
        return self.keeper.recall()

    @property
    def paused(self):
        """Tell whether something waits to be kept before it can be said."""
        return self._unsaid is not None

    def answer(self, utterances):
        """Keep what the actor was told, if that can be, and then say the reply; else pause."""
        if not utterances or self.mistake:  # which ends it: what was kept stays as it is
            return
        if self._unsaid is not None:
            self._unsaid = (*self._unsaid, *utterances)
            return
        if self.keeper is None:
            self.actor.told.clear()
        elif not self._keep():
            self._unsaid = utterances
            return
        self.say(utterances)

    def say(self, utterances):
        """Publish, or log, each of the tuples."""
        for said in utterances:
            self._voices[type(said)](said)

    def look(self):
        """Return what the actor has to say once a second."""
        return self.actor.look()

    def leave(self):
        """Close what is kept: the node ends."""
        if self.keeper:
            self.keeper.close()

    def _keep(self):
        """Return whether what the actor was told is kept now; the journal is made anew if due."""
        try:
            self._keep_all()
        except OSError as error:
            self._pause(error)
            return False
        if self.keeper.is_due():
            self._renew()
        return True

    def _keep_all(self):
        """Keep what the actor was told; raises OSError, and the next call does what is left."""
        actor, keeper = self.actor, self.keeper
        try:
            if actor.begins:
                keeper.begin(*actor.state())
                actor.begins = False
            else:
                keeper.keep(actor.told)
        finally:
            actor.told.clear()  # the state has it, or the keeper

    def _renew(self):
        """Write a new snapshot; where that cannot be, the journal goes on."""
        try:
            self.keeper.begin(*self.actor.state())
        except OSError as error:
            self.keeper.put_off()
            self.get_logger().warning(f'no new snapshot in state_dir {self._state_dir!r} '
                                      f'({error.strerror.lower()}): the journal goes on')

    def _make_anew(self):
        """Keep all in a new `state_dir`, where somebody took the old one away; else pause."""
        self.get_logger().warning(f'state_dir {self._state_dir!r} was taken away: it is made anew')
        self.actor.begins = True
        if not self._keep():
            self._unsaid = ()

    def _pause(self, error):
        self._trouble = f'pauses: state_dir {self._state_dir!r} cannot be written ' \
                        f'({error.strerror.lower()})'
        self.get_logger().error(f'{self._trouble}; goes on when it can')
        self._retry.reset()

    def _try_again(self):
        """Keep what could not be kept before, and then say what follows from it."""
        try:
            self._keep_all()
        except OSError:
            return  # told when it began
        self._retry.cancel()
        self.get_logger().info('state_dir can be written again: goes on')
        unsaid, self._unsaid, self._trouble = self._unsaid, None, None
        self.say(unsaid)

    def _look(self):
        """Once a second: look at what the actor waits for, at the disk, and who else is there."""
        if self.actor is None or self.mistake:
            return
        if self._unsaid is None:
            if self.keeper and self.keeper.is_lost():
                self._make_anew()
            self.answer(self.look() if self._unsaid is None else ())
        for remark in self._strangers.look():
            self.get_logger().warning(remark)
        self.health.publish(*self._status(), self.actor.turns, self.keeper)

    def _status(self):
        """Level and words of how it is; what it has been waiting for is told once."""
        what, seconds = self._waited
        now = self.actor.waits_for()
        self._waited = now, seconds + 1 if now == what else 0
        if now and self._waited[1] == PATIENCE and not self._aside:
            self.get_logger().warning(f'waits for {now}')
        if self._aside or self._trouble:
            return ERROR, self._aside or self._trouble
        if now and self._waited[1] >= PATIENCE:
            return WARN, f'waits for {now}'
        return OK, self.words()

    def words(self):
        """How it is while all is well."""
        return 'runs'

    def _warn(self, said):
        self.health.refused[said.kind] += 1
        if self.health.refused[said.kind] == 1:
            self.get_logger().warning(f'refused: {said.reason} (told once, counted)')

    def _drop(self, said):
        self.health.dropped[said.kind] += 1
        if self.health.dropped[said.kind] == 1:
            self.get_logger().info(f'{said.reason} (harmless; told once, counted)')

    def _tell(self, said):
        self.get_logger().info(said.text)

    def _stand_aside(self, said):
        """Fall silent for good: nothing of this node is found on its topics and services."""
        self._aside = f'{STANDS_ASIDE}: {said.reason}'
        self.get_logger().error(self._aside)
        for end in self._ends:
            self.destroy_publisher(end)
        for service in self._services_of_ours:
            self.destroy_service(service)
        self._voices = dict.fromkeys(self._voices, lambda said: None)


def map_words(name, sha256):
    """Name of a map with what tells it from every other of that name."""
    return f'{name} ({sha256[:12]})'
