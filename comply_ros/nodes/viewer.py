# SPDX-License-Identifier: Apache-2.0
"""The node that publishes a lesson as messages that RViz, Foxglove and plotters show."""

from collections import deque
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import Float64, Header

from comply_ros.nodes import topics
from comply_ros.nodes import viewer_markers as markers
from comply_ros.nodes import viewer_messages as views
from comply_ros.nodes.clocks import steady_timer, waiting_for
from comply_ros.nodes.parameter_node import SafeParameterNode
from comply_ros.nodes.parameters import (
    CELL_SIZE,
    FRAME,
    MAP_RATE,
    ParameterError,
    ROBOT_FRAME,
    ROBOT_RATE,
    TRAIL_LENGTH,
)
from comply_ros.nodes.protocol_node import PATIENCE
from comply_ros.nodes.spin import run_node
from comply_ros.plots.viewer_geometry import heading, places_of, StatePlaces
from comply_ros.protocol.message_validation import rejected_description
from comply_ros.protocol.messages import Notice, Outputs, REPORTS, StateReward
from comply_ros.protocol.run_view import RunView
from comply_ros.protocol.state_maps import MentorReports
from comply_ros.world.mdp import World

# A slow viewer never makes the world send again: what is lost is not shown.
LOSSY = QoSProfile(depth=1000, reliability=ReliabilityPolicy.BEST_EFFORT,
                   durability=DurabilityPolicy.VOLATILE)
TRANSFORMS = QoSProfile(depth=100)  # as tf2 publishes on /tf
NOWHERE = StatePlaces(0, 0, 0.0, (0.0, 0.0))  # of the states of no world
MAX_STATES = 40_000  # of a world that is shown with markers in every state


class ViewerNode(SafeParameterNode):
    """Receives everything, and publishes what changed, by timers; no other node waits for it."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__('viewer', **kwargs)
        self.mistake = None  # an exception here would end the node
        self._frame, self._cell = checked_frame(self.declare(FRAME)), self.declare(CELL_SIZE)
        self._robot_frame = checked_frame(self.declare(ROBOT_FRAME), 'robot_frame', True)
        length = self.declare(TRAIL_LENGTH)
        self._view, self._places = RunView(self._start_run, length), NOWHERE
        self._received: deque[bytes] = deque(maxlen=max(length, 2))  # states; few are decoded
        self._returns: dict[str, deque[Any]] = {
            topic.name: deque(maxlen=REPORTS) for topic in (topics.EPISODE, topics.PROGRESS)}
        self._published_returns: set[views.View] = set()
        self._logged: set[str] = set()  # kinds of what is logged once
        self._mentors: set[str] = set()  # names of those whose policies it subscribes to
        self._trust_views: dict[str, views.View] = {}  # of each of several mentors
        self._shown_mentors: tuple[str, ...] = ('',)  # names of those that are shown
        self._ticks_waited, self._angle = 0, 0.0
        self._publish = {view: self.create_publisher(view.message, view.name, view.qos).publish
                         for view in views.VIEWS}
        self._tf_type = tf_message_type() if self._robot_frame else None
        self._tf_publisher = self._tf_type and self.create_publisher(
            self._tf_type, '/tf', TRANSFORMS)
        self._read_state = topics.reader(topics.STATE)
        self.create_subscription(
            topics.STATE.message, topics.STATE.name,
            lambda content: self._received.append(content), LOSSY, raw=True)
        self._subscribe(topics.WORLD, partial(self._receive, topics.WORLD.name))
        for topic in (topics.EPISODE, topics.PROGRESS):
            self._subscribe(topic, partial(self._receive_result, topic.name))
        for topic in (topics.TRUST, topics.MENTOR_POLICY, topics.POLICY, topics.VALUES,
                      topics.DESCRIPTION._replace(qos=topics.LATCHED)):
            self._subscribe(topic, partial(self._receive, topic.name))
        steady_timer(self, 1.0 / self.declare(ROBOT_RATE), self._show_robot)
        steady_timer(self, 1.0 / self.declare(MAP_RATE), self._show_maps)
        steady_timer(self, 1.0, self._tick)

    def leave(self) -> None:
        """Do nothing: nothing is stored."""

    def _subscribe(self, topic: topics.Topic, receive: Callable[[Any], Any]) -> None:
        read = topics.reader(topic)

        def callback(content: bytes) -> None:
            try:
                msg = read(content)
            except topics.MessageError as error:
                self._warn_once(f'unreadable {topic.name}', f'rejected: {error} (logged once)')
                return
            receive(msg)
        self.create_subscription(topic.message, topic.name, callback, topic.qos, raw=True)

    def _receive(self, topic: str, msg: Any) -> None:
        try:
            self._log(self._view.receive(topic, msg))
        except ValueError as error:  # of a world
            self._log((rejected_description(error),))

    def _receive_result(self, topic: str, msg: Any) -> None:
        self._returns[topic].append(msg)
        self._receive(topic, msg)

    def _start_run(self, is_reset: bool) -> Outputs:
        description = self._view.reports.description
        assert description is not None and self._view.world is not None
        had_map = self._places.is_map
        self._places, self._angle = places_of(self._view.world, self._cell), 0.0
        if had_map and not self._places.is_map:
            for view in views.MAP, views.TRUST_MAP, *self._trust_views.values():
                self._publish[view](views.no_map_message(self._header()))
        return (Notice(f'shows world {description.name!r}, run {description.run}'),)

    def _tick(self) -> None:
        """Once a second: turn to another world if this one is gone; log what is missing."""
        self._log(self._view.tick())
        for name in topics.new_mentors(self, self._mentors):
            topic = topics.topic_of_mentor(topics.MENTOR_POLICY, name)
            self._subscribe(topic, partial(self._receive, topic.name))
        missing = waiting_for(self, self._view.waiting_for())
        self._ticks_waited = self._ticks_waited + 1 if missing else 0
        if self._ticks_waited == PATIENCE:
            self.get_logger().warning(f'waits for {missing}')

    def _log(self, outputs: Iterable[Any]) -> None:
        """Log notices, and what was rejected once for each kind."""
        for msg in outputs:
            if isinstance(msg, Notice):
                self.get_logger().info(msg.text)
            else:
                self._warn_once(msg.kind, f'rejected: {msg.reason} (logged once)')

    def _warn_once(self, kind: str, text: str) -> None:
        if kind not in self._logged:
            self._logged.add(kind)
            self.get_logger().warning(text)

    def _show_robot(self) -> None:
        """Publish the robot's pose and trail in this episode, and the returns that came."""
        for msg in self._new_states():
            self._log(self._view.receive('state', msg))
        if self._view.world is None:
            return
        if 'state' in self._view.changed and self._view.trail:
            self._view.changed.discard('state')
            self._show_pose_and_trail()
        self._publish_returns(topics.EPISODE, views.EPISODE_RETURN, 'total_reward')
        self._publish_returns(topics.PROGRESS, views.MEAN_RETURN, 'mean_return')

    def _show_pose_and_trail(self) -> None:
        """Publish where the robot is, and the path to it; in a table of states it never turns."""
        trail, header = self._places.centers(self._view.trail), self._header()
        if len(trail) > 1 and not self._places.are_a_table:
            self._angle = heading(*trail[-2:]) or 0.0
        pose = views.pose_message(header, trail[-1], self._angle)
        self._publish[views.ROBOT](pose)
        if self._tf_publisher:
            self._tf_publisher.publish(views.tf_message(self._tf_type, pose, self._robot_frame))
        self._publish[views.TRAIL](views.trail_message(header, trail))

    def _new_states(self) -> Iterable[StateReward]:
        """Return the states since the last time, from the newest start of an episode on."""
        found: list[StateReward] = []
        while self._received:
            try:
                found.append(self._read_state(self._received.pop()))
            except topics.MessageError as error:
                self._warn_once('unreadable state', f'rejected: {error} (logged once)')
                continue
            if found[-1].step == 0:
                self._received.clear()
        return reversed(found)

    def _publish_returns(self, topic: topics.Topic, view: views.View, field: str) -> None:
        """Publish each return of this run; of those that were latched, only the last."""
        returns = [getattr(msg, field) for msg in self._returns[topic.name]
                   if msg.run == self._view.tracker.run and not getattr(msg, 'mentor', '')]
        self._returns[topic.name].clear()
        for value in returns if view in self._published_returns else returns[-1:]:
            self._publish[view](Float64(data=value))
            self._published_returns.add(view)

    def _show_maps(self) -> None:
        """Publish the maps and markers that changed."""
        world, places, header = self._view.world, self._places, self._header()
        changed = self._view.changed - {'state'}
        self._view.changed -= changed
        if world is None or not changed:
            return
        reports = self._view.reports
        mentors = {name: reports.of_mentor(name) for name in reports.mentor_names()}
        if self._shown_mentors != (*mentors,):
            self._shown_mentors = (*mentors,)
            changed |= {'trust', 'mentor_policy'}
        if 'world' in changed and places.is_map:
            self._publish[views.MAP](views.map_message(header, world, places))
        if 'trust' in changed and places.is_map:
            self._show_trust(world, mentors, header)
        if 'world' in changed:
            self._publish[views.PLACES](markers.places_message(header, world, places))
        if not self._can_have_markers(world):
            return
        has_legend = len(mentors) > 1
        if {'trust', 'mentor_policy', 'policy', *has_legend * ('progress',)} & changed:
            self._show_mentors(world, mentors, header)
        if 'policy' in changed:
            self._publish[views.POLICY](
                markers.policy_message(header, world, places, reports.policy))
        if 'values' in changed:
            self._publish[views.VALUES](
                markers.values_message(header, world, places, reports.values))

    def _show_trust(self, world: World, mentors: dict[str, MentorReports],
                    header: Header) -> None:
        """Publish the map of the trust: of several mentors, of the largest and of each."""
        self._publish[views.TRUST_MAP](views.trust_message(
            header, world, self._places, markers.largest_trust(mentors)))
        for name, known in mentors.items() if len(mentors) > 1 else ():
            if name not in self._trust_views and len(self._trust_views) <= topics.MOST_MENTORS:
                view = self._trust_views[name] = views.trust_view(name)
                self._publish[view] = self.create_publisher(
                    view.message, view.name, view.qos).publish
            if name in self._trust_views:
                self._publish[self._trust_views[name]](views.trust_message(
                    header, world, self._places, known.trust))

    def _show_mentors(self, world: World, mentors: dict[str, MentorReports],
                      header: Header) -> None:
        """Publish the advice of the mentors as markers."""
        learned = self._view.reports.policy
        if len(mentors) > 1:
            message = markers.mentors_message(header, world, self._places, mentors, learned)
        else:
            known, = mentors.values()
            message = markers.mentor_message(
                header, world, self._places, known.policy, known.trust, learned)
        self._publish[views.MENTOR](message)

    def _can_have_markers(self, world: World) -> bool:
        """Return whether a world can be shown with markers in its states; log once if not."""
        if len(world.free) > MAX_STATES:
            self._warn_once(
                'too large', f'a world must have at most {MAX_STATES} states to be shown with '
                f'markers in them, got {len(world.free)}: its maps, ends and robot are shown')
        return len(world.free) <= MAX_STATES

    def _header(self) -> Header:
        return Header(stamp=self.get_clock().now().to_msg(), frame_id=self._frame)


def checked_frame(name: str, parameter: str = 'frame', may_be_empty: bool = False) -> str:
    """Return the name of a coordinate frame; raises ParameterError if it is none (REP 105)."""
    if name.startswith('/') or not (name or may_be_empty):
        raise ParameterError(f'parameter {parameter} must be the name of a frame without a slash '
                             f'in front, such as map, got {name!r}')
    return name


def tf_message_type() -> type | None:
    """Class of the messages on `/tf`; None where tf2_msgs is not installed: it is no wheel."""
    try:
        from tf2_msgs.msg import TFMessage
    except ImportError:
        return None
    return TFMessage


def main(argv: list[str]) -> int:
    """Run the node; return the exit code."""
    return run_node(ViewerNode, argv, (ParameterError,))
