# SPDX-License-Identifier: Apache-2.0
"""The node of the page: it receives what a run reports, and calls services for the buttons."""

from collections.abc import Callable
import copy
from functools import partial
import os
import time
from typing import Any, NamedTuple

from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.msg import ParameterEvent
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from std_srvs.srv import SetBool, Trigger

from comply_ros.dashboard.node_discovery import (
    DEFAULT_NODES,
    LEARNER,
    LessonNode,
    LessonNodes,
    missing_text,
    ROLES,
    WORLD,
)
from comply_ros.dashboard.picture_receiver import PictureReceiver
from comply_ros.dashboard.reference_returns_cache import ReferenceReturnsCache
from comply_ros.dashboard.remote_parameters import RemoteParameter, RemoteParameters
from comply_ros.dashboard.service_client import ServiceCallError, ServiceClient
from comply_ros.learner.learner_config import CONFIG_FIELDS
from comply_ros.mentor.several_mentors import validate_mentor_names
from comply_ros.nodes import parameters, topics
from comply_ros.nodes.diagnostics import process_name, TOPIC
from comply_ros.nodes.node_processes import NodeProcess
from comply_ros.nodes.parameter_node import SafeParameterNode
from comply_ros.protocol.run_reports import RunReports
from comply_ros.protocol.run_view import RunView
from comply_ros.world.mdp import World

PERIOD = 0.1  # seconds between two updates of the page's state
MAX_CALLBACKS = 60  # in one update
MAX_IDLE_CALLBACKS = 8  # in a row that bring no report: then an update has received enough
MAX_OTHER_NODES = 9  # with a row on the page, besides world, mentor and learner
MAX_STATUS_LENGTH, MAX_STATUS_VALUES = 200, 50  # characters, and values, that are kept of a status
FORGOTTEN_AFTER = 60.0  # seconds without a status after which the row of another node is removed
LOST_AFTER = 3.5  # seconds without a status after which a node counts as lost
# Services of the nodes that have these roles, and their types.
SERVICES = {WORLD: {'pause': SetBool, 'step': Trigger, 'reset': Trigger},
            LEARNER: {'reset': Trigger}}
# The learner's parameters on the page, by name: description, and choices where there are any.
LEARNER_PARAMETERS = {
    **{name: (field.metadata['text'], field.metadata.get('choices'))
       for name, field in CONFIG_FIELDS.items()},
    **{each.name: (each.description, each.choices)
       for each in (parameters.REMEMBERS_ADVICE, parameters.ADVICE_TIMEOUT)}}
# What the page reads, beside the timeouts of mentors; it sets all but `mentors`.
PARAMETERS = {WORLD: ('rate',), LEARNER: (*LEARNER_PARAMETERS, parameters.MENTORS.name)}
# Of states and actions only the newest counts, and a publisher must never wait for the page.
NEWEST = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT,
                    durability=DurabilityPolicy.VOLATILE)


class NodeStatus(NamedTuple):
    """The last status of a node on /diagnostics; `received`: time by the steady clock."""

    level: bytes
    message: str
    values: dict[str, str]
    process: str
    received: float


class RunSnapshot(NamedTuple):
    """A run at one moment: its world, None before it is known, and its reports."""

    world: World | None = None
    reports: RunReports = RunReports()


class PageState(NamedTuple):
    """All that a page shows at one moment; it never changes, so that any thread may read it."""

    run: RunSnapshot = RunSnapshot()
    reference_returns: tuple[float | None, float | None] = (None, None)  # of (optimal, mentor)
    nodes: dict[str, NodeStatus] = {}
    roles: dict[str, LessonNode] = DEFAULT_NODES  # which node has each role
    parameters: dict[str, dict[str, RemoteParameter]] = {}  # by role, then by parameter
    time: float = 0.0  # of this state, by the steady clock
    start_time: float = 0.0  # of the dashboard
    other_mentors: int = 0  # that are heard, besides the one of the page
    mentor_names: tuple[str, ...] = ('',)  # as `LessonNodes` has them
    is_name_shared: bool = True  # so does this
    ended: dict[str, str] = {}  # of the nodes that the demo has started: how they ended, by name
    has_pictures: bool = False  # whether a node publishes pictures of its environment
    picture: str = ''  # the last of them, as `PictureReceiver.url`

    def silence(self, name: str) -> float | None:
        """Seconds since the last status of a node; None where there was none."""
        return self.time - self.nodes[name].received if name in self.nodes else None

    def is_alive(self, name: str) -> bool:
        """Whether a node has sent its status lately."""
        silence = self.silence(name)
        return silence is not None and silence < LOST_AFTER

    def is_here(self, role: str) -> bool:
        """Whether the node of a role is alive, as far as one that never sends a status says."""
        node = self.roles[role]
        return self.is_alive(node.name) or node.is_publishing and node.name not in self.nodes

    def status(self, role: str) -> NodeStatus | None:
        """Return the status of the node that has a role; None if it has sent none lately."""
        name = self.roles[role].name
        return self.nodes[name] if self.is_alive(name) else None

    @property
    def paused(self) -> bool:
        """Whether the world reports that it is paused."""
        status = self.status(WORLD)
        return status is not None and status.message.startswith('is paused')


class MentorsHeard:
    """The processes that send statuses of a mentor; a killed one is not heard any more."""

    def __init__(self) -> None:
        self._first: dict[str, float] = {}  # time of the first status of each
        self._last: dict[str, float] = {}

    def add(self, process: str) -> None:
        """Note a status of a mentor in a process."""
        now = time.monotonic()
        self._last = {each: last for each, last in self._last.items() if now - last < LOST_AFTER}
        self._first = {each: self._first[each] for each in self._last}
        self._first.setdefault(process, now)
        self._last[process] = now

    def others(self, own: str) -> int:
        """Return how many processes have been heard since the last one of them came."""
        newest, now = max(self._first.values(), default=0.0), time.monotonic()
        return sum(last >= newest and now - last < LOST_AFTER and process != own
                   for process, last in self._last.items())


class DashboardNode(SafeParameterNode):
    """Receives all reports of a run; `update` spins it and renews its `page_state`."""

    rejected_parameters = {'token': (
        'parameter token must not be given: all users of this machine see the command line of a '
        'process; use the environment variable COMPLY_ROS_TOKEN or the parameter token_file')}

    def __init__(self, **kwargs: Any) -> None:
        super().__init__('dashboard', **kwargs)
        self.address, self.port, self.token_file, self.teach, self.mentor_name = (
            self.declare(each) for each in (
                parameters.ADDRESS, parameters.PORT, parameters.TOKEN_FILE, parameters.TEACH,
                parameters.PERSON_NAME))
        validate_mentor_names([self.mentor_name])
        self.page_state, self._start_time = PageState(), time.monotonic()
        self._run_view, self._reference_returns = RunView(), ReferenceReturnsCache()
        self._nodes: dict[str, NodeStatus] = {}
        self._lesson_nodes = LessonNodes(self)
        self._last_tick, self._received_reports = 0.0, 0
        self._service_client = ServiceClient(self)
        self._remote_parameters: dict[str, RemoteParameters] = {}  # by role
        self._make_clients()
        self.processes: list[NodeProcess] = []  # started for the page, which tells if they end
        self._mentors, self.pictures = MentorsHeard(), PictureReceiver(self)
        self._named_mentors: set[str] = set()  # whose policies it subscribes to
        self._subscribe_to_all()
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self)

    def update(self) -> None:
        """Send pending requests, receive messages, and renew `page_state`; takes 0.1 s."""
        self._service_client.send_pending(PERIOD)
        self._receive()
        now = time.monotonic()
        if now - self._last_tick >= 1.0:
            self._last_tick = now
            self._run_view.tick()
            self.pictures.tick()
            self._update_lesson_nodes(now)
            self._read_timeouts()
            for role, remote in self._remote_parameters.items():
                if self.page_state.is_here(role):
                    remote.tick()
        run = RunSnapshot(self._run_view.world, copy.copy(self._run_view.reports))
        reports, names = run.reports, run.reports.mentor_names()
        self.page_state = PageState(
            run, self._reference_returns.get(run.world, reports.of_mentor(names[0]).policy if
                                             len(names) == 1 else None),
            {**self._nodes}, {**self._lesson_nodes.by_role},
            {role: each.current for role, each in self._remote_parameters.items()}, now,
            self._start_time, self.other_mentors(), self._lesson_nodes.mentor_names,
            self._lesson_nodes.is_name_shared, self._ended(), self.pictures.is_published,
            self.pictures.url)

    def other_mentors(self) -> int:
        """
        Return how many mentors are heard besides the one of this process.

        One that never sent a status counts while it publishes, but for one that is named `mentor`.
        """
        return (self._mentors.others(process_name(os.getpid()))
                + self._lesson_nodes.silent_mentors(self._nodes))

    def start_again(self) -> None:
        """Start those nodes of the page again that have ended."""
        for process in self.processes:
            if process.end_report() is not None:
                process.start()

    def _ended(self) -> dict[str, str]:
        reports = {each.name: each.end_report() for each in self.processes}
        ended = {name: report for name, report in reports.items() if report is not None}
        for name in ended.keys() - self.page_state.ended.keys():
            self.get_logger().error(ended[name])
        return ended

    def _receive(self) -> None:
        """Receive reports until there are no more; of states and actions, only the newest."""
        idle = 0
        for _ in range(MAX_CALLBACKS):
            before = self._received_reports
            self._executor.spin_once(timeout_sec=0.0)
            idle = 0 if self._received_reports != before else idle + 1
            if idle == MAX_IDLE_CALLBACKS:
                return

    def close(self) -> None:
        """Shut down the executor."""
        self._executor.shutdown()

    async def set_paused(self, paused: bool) -> None:
        """Pause or resume the world; raises ServiceCallError, as all that follow."""
        await self._call(WORLD, 'pause', SetBool.Request(data=paused))

    async def step(self) -> None:
        """Have a paused world make one step."""
        await self._call(WORLD, 'step', Trigger.Request())

    async def reset(self) -> None:
        """Reset the learner, which forgets everything, and the world, paused meanwhile."""
        paused = self.page_state.paused
        await self.set_paused(True)
        try:
            await self._call(LEARNER, 'reset', Trigger.Request())
            await self._call(WORLD, 'reset', Trigger.Request())
        finally:
            if not paused:
                await self.set_paused(False)

    async def set_remote_parameter(self, role: str, name: str, value: Any) -> None:
        """Set a parameter of the node that has a role."""
        self._check(role)
        await self._remote_parameters[role].set(name, value)

    async def _call(self, role: str, service: str, request: Any) -> None:
        name = self._check(role)
        response = await self._service_client.call(f'{name}/{service}', request)
        if not response.success:
            raise ServiceCallError(response.message)

    def _check(self, role: str) -> str:
        """Return the name of the node that has a role; raises ServiceCallError without one."""
        node = self._lesson_nodes.by_role[role]
        if not node.is_publishing and node.name not in self._nodes:
            raise ServiceCallError(missing_text(role, node))
        return node.name

    def _make_clients(self) -> None:
        """Make what calls the services of the nodes that have the roles now."""
        for role, node in self._lesson_nodes.by_role.items():
            for service, kind in SERVICES.get(role, {}).items():
                self._service_client.add(kind, f'{node.name}/{service}')
            remote = self._remote_parameters.get(role)
            if role in PARAMETERS and (remote is None or remote.node_name != node.name):
                self._remote_parameters[role] = RemoteParameters(
                    node.name, PARAMETERS[role], self._service_client)

    def _read_timeouts(self) -> None:
        """Read how long the learner waits for each mentor too, as soon as it has the mentor."""
        learner = self._run_view.reports.learner
        if learner and LEARNER in self._remote_parameters:
            self._remote_parameters[LEARNER].read_also(
                parameters.timeout_of(name).name for name in learner.mentors if name)

    def _subscribe_to_all(self) -> None:
        for topic in (topics.STATE, topics.ACTION, topics.EPISODE):
            self._subscribe(topic, False, NEWEST)
        for topic in (topics.WORLD, topics.PROGRESS, topics.TRUST, topics.POLICY,
                      topics.MENTOR_POLICY, topics.DESCRIPTION):
            self._subscribe(topic, True, topics.LATCHED if topic is topics.DESCRIPTION
                            else topic.qos)
        self.create_subscription(DiagnosticArray, TOPIC, self._on_diagnostics, 10)
        self.create_subscription(ParameterEvent, '/parameter_events',
                                 self._on_parameter_event, 10)

    def _subscribe(self, topic: topics.Topic, is_report: bool, qos: QoSProfile) -> None:
        self.create_subscription(
            topic.message, topic.name,
            partial(self._on_message, topic.name, topics.reader(topic), is_report), qos, raw=True)

    def _on_message(self, topic: str, read: Callable[[bytes], Any], is_report: bool,
                    content: bytes) -> None:
        self._received_reports += is_report
        try:
            self._run_view.receive(topic, read(content))
        except ValueError as error:  # of a world, or of bytes that cannot be read
            self.get_logger().warning(f'rejected: {error}', once=True)

    def _on_diagnostics(self, msg: DiagnosticArray) -> None:
        for status in msg.status:
            name = self._lesson_nodes.local_name(status.name)
            if not self._has_row(name):
                continue
            if self._lesson_nodes.is_mentor(name):
                self._mentors.add(status.hardware_id)
            before = self._nodes.get(name)
            if before is None or before.process != status.hardware_id:
                for remote in self._remotes(name):
                    remote.current = {}  # of a new process: to be read again
            self._nodes[name] = NodeStatus(
                status.level, ' '.join(status.message.split())[:MAX_STATUS_LENGTH],
                {each.key: each.value for each in status.values[:MAX_STATUS_VALUES]},
                status.hardware_id, time.monotonic())

    def _has_row(self, name: str) -> bool:
        """Whether a node has a row on the page, or may get one."""
        expected = self._expected_nodes()
        others = self._nodes.keys() - expected
        return name in self._lesson_nodes.names and (
            name in expected or name in others or len(others) < MAX_OTHER_NODES)

    def _expected_nodes(self) -> set[str]:
        """Names of the nodes that have the roles, and of those that may get them by name."""
        return {*ROLES, *(each.name for each in self._lesson_nodes.by_role.values())}

    def _update_lesson_nodes(self, now: float) -> None:
        """Look for the nodes that take part in this lesson; forget others that are gone."""
        self._lesson_nodes.update(self.page_state.is_alive)
        for name in topics.new_mentors(self, self._named_mentors):
            topic = topics.topic_of_mentor(topics.MENTOR_POLICY, name)
            self._subscribe(topic, True, topic.qos)
        self._make_clients()
        expected = self._expected_nodes()
        for name in [*self._nodes]:
            if name not in expected and now - self._nodes[name].received > FORGOTTEN_AFTER:
                del self._nodes[name]

    def _on_parameter_event(self, msg: ParameterEvent) -> None:
        for remote in self._remotes(self._lesson_nodes.local_name(msg.node)):
            remote.on_change(msg.changed_parameters)

    def _remotes(self, node_name: str) -> list[RemoteParameters]:
        return [each for each in self._remote_parameters.values()
                if each.node_name == node_name]
