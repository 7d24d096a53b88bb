# SPDX-License-Identifier: Apache-2.0
"""The node that hears a lesson for the page, looks ten times a second, and asks for controls."""

import time
from typing import NamedTuple

from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.msg import ParameterEvent
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from std_srvs.srv import SetBool, Trigger

from comply_ros.dashboard.reference_returns import ReferenceReturnsCache
from comply_ros.dashboard.remote_parameters import RemoteParameters
from comply_ros.dashboard.run_view import Onlooker, Sight
from comply_ros.dashboard.service_client import NoAnswerError, ServiceClient
from comply_ros.learner.learner_config import CONFIG_FIELDS
from comply_ros.nodes import topics
from comply_ros.nodes.diagnostics import TOPIC
from comply_ros.nodes.parameters import ADDRESS, PORT, SafeParameterNode, TEACH, TOKEN

LOOK = 0.1  # seconds between two looks: a state in between is not even read
READS, IDLE = 60, 8  # callbacks in one look, at most, and in a row that bring no report
EXPECTED = ('grid_world', 'mentor', 'learner')
SILENT = 3.5  # seconds without a word on /diagnostics after which a node counts as lost
PAUSE, STEP, RESET, FORGET = (
    'grid_world/pause', 'grid_world/step', 'grid_world/reset', 'learner/reset')
# Only the newest counts, and a node that speaks never waits for a page that hears: best effort.
NEWEST = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT,
                    durability=DurabilityPolicy.VOLATILE)


class Status(NamedTuple):
    """How a node said that it is; `heard` in seconds of the monotonic clock."""

    level: int
    words: str
    values: dict
    process: str
    heard: float


class View(NamedTuple):
    """
    All that a page shows, at one moment; it never changes, so that any thread may read it.

    Attributes
    ----------
    sight: the `Sight` of the lesson.
    levels: (optimal, mentor): expected returns; None where not known or nobody advises.
    health: table of `Status` by name of the node.
    settings: table by node of tables of `RemoteParameter` by name.
    at, began: when that was, and when it was begun to look, in seconds of the monotonic clock.

    """

    sight: Sight = Sight()
    levels: tuple = (None, None)
    health: dict = {}
    settings: dict = {}
    at: float = 0.0
    began: float = 0.0

    def silent(self, name):
        """Seconds since a node was heard; None where it never was."""
        return self.at - self.health[name].heard if name in self.health else None

    def lives(self, name):
        """Tell whether a node was heard of late."""
        return name in self.health and self.silent(name) < SILENT

    @property
    def paused(self):
        """Whether the world says that it is paused."""
        return self.lives('grid_world') and self.health['grid_world'].words.startswith('is paused')


class DashboardNode(SafeParameterNode):
    """
    Hears everything that is said in a lesson; is spun by `look`.

    Attributes
    ----------
    view: the newest `View`.
    asking: the `ServiceClient` through which the other nodes are asked.
    settings: the `RemoteParameters` of grid_world and learner, by name.
    address, port, token, teach: parameters.

    """

    def __init__(self, **kwargs):
        super().__init__('dashboard', **kwargs)
        self.address, self.port, self.token, self.teach = (
            self.declare(each) for each in (ADDRESS, PORT, TOKEN, TEACH))
        self.view, self.mistake, self._began = View(), None, time.monotonic()
        self._onlooker, self._levels = Onlooker(), ReferenceReturnsCache()
        self._health, self._second, self._reports = {}, 0.0, 0
        self.settings = {name: RemoteParameters(name, names) for name, names in (
            ('grid_world', ('rate',)),
            ('learner', (*CONFIG_FIELDS, 'remembers_advice', 'advice_timeout')))}
        self.asking = ServiceClient(self, [
            (SetBool, PAUSE), (Trigger, STEP), (Trigger, RESET), (Trigger, FORGET),
            *(each for one in self.settings.values() for each in one.services())])
        self._listen_to_all()
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self)

    def look(self):
        """Read what was said since the last look, ask what is to be asked, and renew the view."""
        self.asking.work(LOOK)
        self._read()
        now = time.monotonic()
        if now - self._second >= 1.0:
            self._second = now
            self._onlooker.look()
            self._look_at_settings()
        sight = self._onlooker.sight
        self.view = View(sight, self._levels.of(sight.world, sight.heard.advice),
                         {**self._health}, {name: each.now for name, each in
                                            self.settings.items()}, now, self._began)

    def _read(self):
        """Hear what was said: reports to the last, of states and actions only the newest."""
        idle = 0
        for _ in range(READS):
            before = self._reports
            self._executor.spin_once(timeout_sec=0.0)
            idle = 0 if self._reports != before else idle + 1
            if idle == IDLE:
                return

    def leave(self):
        """End the executor: the node ends."""
        self._executor.shutdown()

    async def pause(self, paused):
        """Pause the world, or let it go on; raises NoAnswerError."""
        _check(await self.asking.ask(PAUSE, SetBool.Request(data=paused)))

    async def step(self):
        """Let a paused world ask exactly one question; raises NoAnswerError."""
        _check(await self.asking.ask(STEP, Trigger.Request()))

    async def reset(self):
        """Begin anew, with a learner that knows nothing; raises NoAnswerError."""
        paused = self.view.paused
        await self.pause(True)
        try:
            _check(await self.asking.ask(FORGET, Trigger.Request()))
            _check(await self.asking.ask(RESET, Trigger.Request()))
        finally:
            if not paused:
                await self.pause(False)

    async def set(self, node, name, value):
        """Change a parameter of a node; raises NoAnswerError with what it says."""
        await self.settings[node].set(self.asking, name, value)

    def _listen_to_all(self):
        onlooker = self._onlooker
        for topic, hear, qos in (
                (topics.WORLD, self._on_world, None),
                (topics.STATE, onlooker.observe, NEWEST),
                (topics.ACTION, onlooker.on_action, NEWEST),
                (topics.EPISODE, onlooker.on_episode, NEWEST),
                (topics.PROGRESS, onlooker.on_progress, None),
                (topics.TRUST, onlooker.on_trust, None),
                (topics.POLICY, onlooker.on_policy, None),
                (topics.MENTOR_POLICY, onlooker.on_mentor_policy, None)):
            self._listen(topic, hear, qos or topic.qos)
        self.create_subscription(DiagnosticArray, TOPIC, self._on_diagnostics, 10)
        self.create_subscription(ParameterEvent, '/parameter_events', self._hear_settings, 10)

    def _listen(self, topic, hear, qos):
        decode, counts = topics.decoder(topic), qos is not NEWEST

        def take(message):
            self._reports += counts
            hear(decode(message))
        self.create_subscription(topic.message, topic.name, take, qos)

    def _on_world(self, msg):
        try:
            self._onlooker.on_world(msg)
        except ValueError as error:
            self.get_logger().warning(f'refused: {error}', once=True)

    def _on_diagnostics(self, msg):
        home = self.get_namespace().strip('/')
        for status in msg.status:
            place, _, name = status.name.rpartition('/')
            if place != home or not name:
                continue
            before = self._health.get(name)
            if before is None or before.process != status.hardware_id:
                self._ask_for_settings(name)
            level = status.level[0] if isinstance(status.level, bytes) else status.level
            self._health[name] = Status(
                level, ' '.join(status.message.split()), {each.key: each.value for each in
                                                          status.values},
                status.hardware_id, time.monotonic())

    def _hear_settings(self, msg):
        place, _, name = msg.node.rpartition('/')
        if name in self.settings and place.strip('/') == self.get_namespace().strip('/'):
            self.settings[name].hear(msg.changed_parameters)

    def _ask_for_settings(self, name):
        if name in self.settings:
            self.settings[name].now = {}

    def _look_at_settings(self):
        for name, settings in self.settings.items():
            if name in self._health and not settings.look():
                settings.backup(self.asking)


def _check(answer):
    if not answer.success:
        raise NoAnswerError(answer.message)
