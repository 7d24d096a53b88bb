# SPDX-License-Identifier: Apache-2.0
"""What the three nodes share: to listen, to keep, to say, and to tell how they are."""

from comply_ros.nodes.checkpointing import Checkpointing
from comply_ros.nodes.diagnostics import Diagnostics, ERROR, INACTIVE, OK, WARN
from comply_ros.nodes.parameters import SafeParameterNode, STATE_DIR
from comply_ros.nodes.topic_type_check import TopicTypeCheck
from comply_ros.nodes.topics import decoder, encoder, RECOMMENDATION
from comply_ros.protocol.messages import Ignored, Inactive, Notice, Rejected

PATIENCE = 3  # seconds of waiting after which a node says for what
AGAIN = 0.2  # seconds between two tries to keep what the disk did not take


class ProtocolNode(SafeParameterNode):
    """
    A node that keeps what its actor was told, then says what it returns.

    Attributes
    ----------
    actor: the state machine of core that this node is a shell of.
    health: counts of what was refused and dropped.
    store: the `Checkpointing` of its state.
    mistake: an exception that a callback found; it ends the node.

    """

    def __init__(self, name, **kwargs):
        super().__init__(name, **kwargs)
        self.actor, self.mistake = None, None
        self.health, self._strangers = Diagnostics(self), TopicTypeCheck(self)
        self.store = Checkpointing(self, self.declare(STATE_DIR))
        self._ends, self._services_of_ours = [], []
        self._unsaid, self._aside = None, None
        self._waited = None, 0
        self._handlers = {Rejected: self._warn, Ignored: self._drop, Notice: self._tell,
                        Inactive: self._stand_aside}
        self._retry = self.create_timer(AGAIN, self._try_again)
        self._retry.cancel()
        self.create_timer(1.0, self._look)

    def advertise(self, topic):
        """Make a publisher: tuples of the topic's kind that are said go there."""
        publisher, encode = self.create_publisher(topic.message, topic.name, topic.qos), \
            encoder(topic)
        publish = publisher.publish
        self._ends.append(publisher)
        self._handlers[topic.tuple_type] = lambda msg: publish(encode(msg))
        self._strangers.watch(topic)

    def serves(self, kind, name, reply):
        """Make a service."""
        self._services_of_ours.append(self.create_service(kind, name, reply))

    def subscribe(self, topic, hear, also_paused=False):
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
        self._strangers.watch(topic, single_publisher=topic is RECOMMENDATION)

    @property
    def paused(self):
        """Tell whether something waits to be kept before it can be said."""
        return self._unsaid is not None

    def answer(self, outputs):
        """Keep what the actor was told, if that can be, and then say the reply; else pause."""
        if not outputs or self.mistake:  # which ends it: what was kept stays as it is
            return
        if self._unsaid is not None:
            self._unsaid = (*self._unsaid, *outputs)
        elif self.store.save(self.actor):
            self.say(outputs)
        else:
            self._pause(outputs)

    def say(self, outputs):
        """Publish, or log, each of the tuples."""
        for msg in outputs:
            self._handlers[type(msg)](msg)

    def look(self):
        """Return what the actor has to say once a second."""
        return self.actor.look()

    def leave(self):
        """Close what is kept: the node ends."""
        self.store.close()

    def _try_again(self):
        """Keep what could not be kept before, and then say what follows from it."""
        if self._unsaid is not None and self.store.save(self.actor):
            self._retry.cancel()
            self.actor.allow_gap()
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
        if self._unsaid is None and not self.store.save_if_removed(self.actor):
            self._pause(())
        elif self._unsaid is None:
            self.answer(self.look())
        for remark in self._strangers.tick():
            self.get_logger().warning(remark)
        self.health.publish(*self._status(), self.actor.turns, self.store.store)

    def _status(self):
        """Level and words of how it is; what it has been waiting for is told once."""
        what, seconds = self._waited
        now = self.actor.waiting_for()
        self._waited = now, seconds + 1 if now == what else 0
        if now and self._waited[1] == PATIENCE and not self._aside:
            self.get_logger().warning(f'waits for {now}')
        if self._aside or self.store.error:
            return ERROR, self._aside or self.store.error
        if now and self._waited[1] >= PATIENCE:
            return WARN, f'waits for {now}'
        return OK, self.words()

    def words(self):
        """How it is while all is well."""
        return 'runs'

    def _warn(self, msg):
        self.health.rejected[msg.kind] += 1
        if self.health.rejected[msg.kind] == 1:
            self.get_logger().warning(f'refused: {msg.reason} (told once, counted)')

    def _drop(self, msg):
        self.health.ignored[msg.kind] += 1
        if self.health.ignored[msg.kind] == 1:
            self.get_logger().info(f'{msg.reason} (harmless; told once, counted)')

    def _tell(self, msg):
        self.get_logger().info(msg.text)

    def _stand_aside(self, msg):
        """Fall silent for good: nothing of this node is found on its topics and services."""
        self._aside = f'{INACTIVE}: {msg.reason}'
        self.get_logger().error(self._aside)
        for end in self._ends:
            self.destroy_publisher(end)
        for service in self._services_of_ours:
            self.destroy_service(service)
        self._handlers = dict.fromkeys(self._handlers, lambda msg: None)


def map_words(name, sha256):
    """Name of a map with what tells it from every other of that name."""
    return f'{name} ({sha256[:12]})'
