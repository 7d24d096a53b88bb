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
from comply_ros.nodes.store import Store
from comply_ros.nodes.strangers import Strangers
from comply_ros.nodes.topics import decoder, encoder, RECOMMENDATION

PATIENCE = 3  # seconds of waiting after which a node says for what
AGAIN = 0.2  # seconds between two tries to keep what the disk did not take


class ActorNode(SturdyNode):
    """
    A node that keeps what its actor was told, then says what it returns.

    Attributes
    ----------
    actor: the state machine of core that this node is a shell of.
    health: counts of what was refused and dropped.
    store: the `Store` of its state.
    mistake: an exception that a callback found; it ends the node.

    """

    def __init__(self, name, **kwargs):
        try:
            super().__init__(name, **kwargs)
        except InvalidParameterTypeException as error:  # of the parameters that every node has
            raise ParameterError(f'a parameter must be of its type: {error}') from None
        self.actor, self.mistake = None, None
        self.health, self._strangers = Health(self), Strangers(self)
        self.store = Store(self, self.declare(STATE_DIR))
        self._ends, self._services_of_ours = [], []
        self._unsaid, self._aside = None, None
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

    def listens_to(self, topic, hear, also_paused=False):
        """
        Subscribe: every message on the topic is decoded, heard, and answered.

        also_paused: whether it is heard and answered too while the node pauses. What is not
            heard then is said again.
        """
        decode = decoder(topic)

        def take(message):
            if self._unsaid is None:
                self.answer(hear(decode(message)))
            elif also_paused:
                self.say(hear(decode(message)))
        self.create_subscription(topic.message, topic.name, take, topic.qos)
        self._strangers.watch(topic, has_one_speaker=topic is RECOMMENDATION)

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
        elif self.store.keep(self.actor):
            self.say(utterances)
        else:
            self._pause(utterances)

    def say(self, utterances):
        """Publish, or log, each of the tuples."""
        for said in utterances:
            self._voices[type(said)](said)

    def look(self):
        """Return what the actor has to say once a second."""
        return self.actor.look()

    def leave(self):
        """Close what is kept: the node ends."""
        self.store.close()

    def _try_again(self):
        """Keep what could not be kept before, and then say what follows from it."""
        if self._unsaid is not None and self.store.keep(self.actor):
            self._retry.cancel()
            self.actor.hear_less()
            unsaid, self._unsaid = self._unsaid, None
            self.say(unsaid)

    def _pause(self, unsaid):
        """Say nothing and hear nothing until what the actor was told can be kept."""
        self._unsaid = unsaid
        self._retry.reset()

    def _look(self):
        """Once a second: look at what the actor waits for, at the disk, and who else is there."""
        if self.actor is None or self.mistake:
            return
        if self._unsaid is None and not self.store.look(self.actor):
            self._pause(())
        elif self._unsaid is None:
            self.answer(self.look())
        for remark in self._strangers.look():
            self.get_logger().warning(remark)
        self.health.publish(*self._status(), self.actor.turns, self.store.keeper)

    def _status(self):
        """Level and words of how it is; what it has been waiting for is told once."""
        what, seconds = self._waited
        now = self.actor.waits_for()
        self._waited = now, seconds + 1 if now == what else 0
        if now and self._waited[1] == PATIENCE and not self._aside:
            self.get_logger().warning(f'waits for {now}')
        if self._aside or self.store.trouble:
            return ERROR, self._aside or self.store.trouble
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
