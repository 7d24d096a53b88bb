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

from comply_ros.dashboard.reference_returns import ReferenceReturnsCache
from comply_ros.dashboard.remote_parameters import RemoteParameter, RemoteParameters
from comply_ros.dashboard.service_client import ServiceCallError, ServiceClient
from comply_ros.learner.learner_config import CONFIG_FIELDS
from comply_ros.nodes import parameters, topics
from comply_ros.nodes.diagnostics import process_name, TOPIC
from comply_ros.nodes.node_processes import NodeProcess
from comply_ros.protocol.run_view import RunReports, RunView
from comply_ros.world.mdp import World

PERIOD = 0.1  # seconds between two updates of the page's state
MAX_CALLBACKS = 60  # in one update
MAX_IDLE_CALLBACKS = 8  # in a row that bring no report: then an update has received enough
EXPECTED_NODES = ('grid_world', 'mentor', 'learner')
MENTOR = 'mentor'
MAX_OTHER_NODES = 9  # with a row on the page, besides those
MAX_STATUS_LENGTH, MAX_STATUS_VALUES = 200, 50  # characters, and values, that are kept of a status
FORGOTTEN_AFTER = 60.0  # seconds without a status after which the row of another node is removed
LESSON_TOPICS = (topics.WORLD, topics.STATE, topics.RECOMMENDATION, topics.ACTION,
                 topics.PROGRESS, topics.EPISODE)  # who publishes on one of them takes part
LOST_AFTER = 3.5  # seconds without a status after which a node counts as lost
PAUSE, STEP, RESET, RESET_LEARNER = (
    'grid_world/pause', 'grid_world/step', 'grid_world/reset', 'learner/reset')
# The learner's parameters on the page, by name: description, and choices where there are any.
LEARNER_PARAMETERS = {
    **{name: (field.metadata['text'], field.metadata.get('choices'))
       for name, field in CONFIG_FIELDS.items()},
    **{each.name: (each.description, each.choices)
       for each in (parameters.REMEMBERS_ADVICE, parameters.ADVICE_TIMEOUT)}}
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
    parameters: dict[str, dict[str, RemoteParameter]] = {}  # by node, then by parameter
    time: float = 0.0  # of this state, by the steady clock
    start_time: float = 0.0  # of the dashboard
    other_mentors: int = 0  # that are heard, besides the one of the page
    ended: dict[str, str] = {}  # of the nodes that the demo has started: how they ended, by name

    def silence(self, name: str) -> float | None:
        """Seconds since the last status of a node; None where there was none."""
        return self.time - self.nodes[name].received if name in self.nodes else None

    def is_alive(self, name: str) -> bool:
        """Whether a node has sent its status lately."""
        silence = self.silence(name)
        return silence is not None and silence < LOST_AFTER

    @property
    def paused(self) -> bool:
        """Whether the world reports that it is paused."""
        return self.is_alive('grid_world') and self.nodes['grid_world'].message.startswith(
            'is paused')


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


class DashboardNode(parameters.SafeParameterNode):
    """Receives all reports of a run; `update` spins it and renews its `page_state`."""

    rejected_parameters = {'token': (
        'parameter token must not be given: all users of this machine see the command line of a '
        'process; use the environment variable COMPLY_ROS_TOKEN or the parameter token_file')}

    def __init__(self, **kwargs: Any) -> None:
        super().__init__('dashboard', **kwargs)
        self.address, self.port, self.token_file, self.teach = (
            self.declare(each) for each in (
                parameters.ADDRESS, parameters.PORT, parameters.TOKEN_FILE, parameters.TEACH))
        self.page_state, self._start_time = PageState(), time.monotonic()
        self._run_view, self._reference_returns = RunView(), ReferenceReturnsCache()
        self._nodes: dict[str, NodeStatus] = {}
        self._lesson_nodes: set[str] = {*EXPECTED_NODES}
        self._last_tick, self._received_reports = 0.0, 0
        self._service_client = ServiceClient(self)
        self._remote_parameters = {
            name: RemoteParameters(name, names, self._service_client) for name, names in (
                ('grid_world', ('rate',)), ('learner', LEARNER_PARAMETERS))}
        self._service_client.add(SetBool, PAUSE)
        for name in (STEP, RESET, RESET_LEARNER):
            self._service_client.add(Trigger, name)
        self.processes: list[NodeProcess] = []  # started for the page, which tells if they end
        self._mentors = MentorsHeard()
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
            self._update_lesson_nodes(now)
            for name, remote in self._remote_parameters.items():
                if name in self._nodes:
                    remote.tick()
        run = RunSnapshot(self._run_view.world, copy.copy(self._run_view.reports))
        self.page_state = PageState(
            run, self._reference_returns.get(run.world, run.reports.mentor_policy),
            {**self._nodes}, {name: each.current for name, each in
                              self._remote_parameters.items()}, now, self._start_time,
            self.other_mentors(), self._ended())

    def mentor_publishers(self) -> int:
        """Return how many publishers of recommendations there are."""
        return self.count_publishers(topics.RECOMMENDATION.name)

    def other_mentors(self) -> int:
        """Return how many mentors are heard besides the one of this process."""
        return self._mentors.others(process_name(os.getpid()))

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
        await self._call(PAUSE, SetBool.Request(data=paused))

    async def step(self) -> None:
        """Have a paused world make one step."""
        await self._call(STEP, Trigger.Request())

    async def reset(self) -> None:
        """Reset the learner, which forgets everything, and the world, paused meanwhile."""
        paused = self.page_state.paused
        await self.set_paused(True)
        try:
            await self._call(RESET_LEARNER, Trigger.Request())
            await self._call(RESET, Trigger.Request())
        finally:
            if not paused:
                await self.set_paused(False)

    async def set_remote_parameter(self, node_name: str, name: str, value: Any) -> None:
        """Set a parameter of another node."""
        await self._remote_parameters[node_name].set(name, value)

    async def _call(self, name: str, request: Any) -> None:
        response = await self._service_client.call(name, request)
        if not response.success:
            raise ServiceCallError(response.message)

    def _subscribe_to_all(self) -> None:
        for topic in (topics.STATE, topics.ACTION, topics.EPISODE):
            self._subscribe(topic, False, NEWEST)
        for topic in (topics.WORLD, topics.PROGRESS, topics.TRUST, topics.POLICY,
                      topics.MENTOR_POLICY):
            self._subscribe(topic, True, topic.qos)
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
            name = self._name_here(status.name)
            if not self._has_row(name):
                continue
            if name == MENTOR:
                self._mentors.add(status.hardware_id)
            before = self._nodes.get(name)
            if name in self._remote_parameters and (
                    before is None or before.process != status.hardware_id):
                self._remote_parameters[name].current = {}  # of a new process: to be read again
            self._nodes[name] = NodeStatus(
                status.level, ' '.join(status.message.split())[:MAX_STATUS_LENGTH],
                {each.key: each.value for each in status.values[:MAX_STATUS_VALUES]},
                status.hardware_id, time.monotonic())

    def _has_row(self, name: str) -> bool:
        """Whether a node has a row on the page, or may get one."""
        others = self._nodes.keys() - set(EXPECTED_NODES)
        return name in self._lesson_nodes and (
            name in EXPECTED_NODES or name in others or len(others) < MAX_OTHER_NODES)

    def _update_lesson_nodes(self, now: float) -> None:
        """Look for the nodes that take part in this lesson; forget others that are gone."""
        self._lesson_nodes = {*EXPECTED_NODES, *(
            self._name_here(f'{each.node_namespace.rstrip("/")}/{each.node_name}')
            for topic in LESSON_TOPICS
            for each in self.get_publishers_info_by_topic(
                self.resolve_topic_name(topic.name)))} - {''}
        for name in [*self._nodes]:
            if name not in EXPECTED_NODES and now - self._nodes[name].received > FORGOTTEN_AFTER:
                del self._nodes[name]

    def _on_parameter_event(self, msg: ParameterEvent) -> None:
        name = self._name_here(msg.node)
        if name in self._remote_parameters:
            self._remote_parameters[name].on_change(msg.changed_parameters)

    def _name_here(self, full_name: str) -> str:
        """Name of a node of this namespace, '' for one of another."""
        namespace, _, name = full_name.rpartition('/')
        return name if namespace.strip('/') == self.get_namespace().strip('/') else ''
