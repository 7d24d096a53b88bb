# SPDX-License-Identifier: Apache-2.0
"""The node that turns the conversation into what RViz, Foxglove and plotters show."""

from collections import deque
from functools import partial

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from std_msgs.msg import Float64
from visualization_msgs.msg import Marker

from comply_ros.nodes import topics, viewer_messages
from comply_ros.nodes.parameters import (
    CELL_SIZE,
    declare,
    FRAME,
    MAP_RATE,
    ParameterError,
    ROBOT_RATE,
    SafeParameterNode,
    TRAIL_LENGTH,
    unknown_overrides,
)
from comply_ros.nodes.protocol_node import PATIENCE
from comply_ros.nodes.spin import run_node
from comply_ros.plots import viewer_geometry
from comply_ros.plots.trust_colors import TRUST_ANCHORS
from comply_ros.protocol import viewer_state
from comply_ros.protocol.messages import Notice, REPORTS
from comply_ros.protocol.validation import rejected_description
from comply_ros.protocol.viewer_state import refused_map, ViewerState

# Never a reason for the world to send again: what is lost is not seen.
OVERHEARD = QoSProfile(depth=1000, reliability=ReliabilityPolicy.BEST_EFFORT,
                       durability=DurabilityPolicy.VOLATILE)
MOST_STATES = 40_000  # of a world that is drawn with a marker in every state
GREY, INK = viewer_messages.rgba((0.6, 0.6, 0.6)), viewer_messages.rgba((0.13, 0.13, 0.13))
GOLD, BLUE = viewer_messages.rgba((0.9, 0.62, 0.0)), viewer_messages.rgba((0.0, 0.45, 0.7), 0.35)
TRUST_COLOURS = viewer_messages.colours_of(TRUST_ANCHORS)
VALUE_COLOURS = viewer_messages.colours_of(viewer_geometry.VALUE_SCALE, 0.85)


class ViewerNode(SafeParameterNode):
    """
    Listens, and publishes what changed on timers of its own; nothing waits for it.

    Attributes
    ----------
    scene: the `ViewerState`, what it knows.
    mistake: None; an exception here would end the node.

    """

    def __init__(self, **kwargs):
        super().__init__('viewer', **kwargs)
        self._frame, self._cell = declare(self, FRAME), declare(self, CELL_SIZE)
        check_frame(self._frame)
        self._longest = declare(self, TRAIL_LENGTH)
        self.scene, self.mistake = ViewerState(self._longest), None
        self._told, self._waited, self._angle = set(), 0, 0.0
        self._states = deque(maxlen=max(self._longest, 2))  # as bytes: few of them are looked at
        self._publish = {view: self.create_publisher(view.message, view.name, view.qos).publish
                         for view in viewer_messages.VIEWS}
        self._listen()
        for parameter, show in ((ROBOT_RATE, self._show_robot), (MAP_RATE, self._show_maps)):
            self.create_timer(1.0 / declare(self, parameter), show)
        self.create_timer(1.0, self._look)
        for unknown in unknown_overrides(self):
            self.get_logger().warning(f'parameter {unknown!r} is unknown and has no effect')

    def _listen(self):
        """Subscribe to all that is said."""
        self.create_subscription(
            topics.STATE.message, topics.STATE.name,
            lambda message: self._states.append(message), OVERHEARD, raw=True)
        self._returns = {topic.name: deque(maxlen=REPORTS)
                         for topic in (topics.EPISODE, topics.PROGRESS)}
        self._hear_on(topics.WORLD, self._on_world)
        for topic in (topics.EPISODE, topics.PROGRESS):
            self._hear_on(topic, self._returns[topic.name].append)
        for topic in (topics.TRUST, topics.MENTOR_POLICY, topics.POLICY, topics.VALUES):
            self._hear_on(topic, partial(self.scene.on_state_map, topic.name))
        self._shown = set()

    def _hear_on(self, topic, hear):
        decode = topics.decoder(topic)
        self.create_subscription(topic.message, topic.name,
                                 lambda message: hear(decode(message)), topic.qos)

    def _on_world(self, msg):
        try:
            self._tell(self.scene.on_world(msg))
        except ValueError as error:
            self._tell((rejected_description(error),))

    def _tell(self, remarks):
        """Log what is to be known; what was refused once for each kind."""
        for msg in remarks:
            if type(msg) is Notice:
                self.get_logger().info(msg.text)
            elif msg.kind not in self._told:
                self._told.add(msg.kind)
                self.get_logger().warning(f'refused: {msg.reason} (told once)')

    def _look(self):
        """Once a second: turn to another world if this one is gone; say what is missing."""
        self._tell(self.scene.look())
        self._waited = self._waited + 1 if self.scene.waiting_for() else 0
        if self._waited == PATIENCE:
            self.get_logger().warning(f'waits for {self.scene.waiting_for()}')

    def _show_robot(self):
        """Publish where the robot is and was in this episode, and the returns that came."""
        for msg in self._newest_states():
            self._tell(self.scene.observe(msg))
        if self.scene.world is None:
            return
        if viewer_state.ROBOT in self.scene.changed and self.scene.trail:
            self.scene.changed.discard(viewer_state.ROBOT)
            self._publish_robot()
        self._publish_returns(topics.EPISODE, viewer_messages.EPISODE_RETURN, 'total_reward')
        self._publish_returns(topics.PROGRESS, viewer_messages.MEAN_RETURN, 'mean_return')

    def _newest_states(self):
        """Return the states that came since the last time, from the last start on."""
        decode, found = topics.decoder(topics.STATE), []
        while self._states:
            found.append(decode(deserialize_message(self._states.pop(), topics.STATE.message)))
            if found[-1].step == 0:
                self._states.clear()
        return reversed(found)

    def _publish_robot(self):
        trail, width = self.scene.trail, self.scene.world.grid.width
        header = viewer_messages.header_of(self, self._frame)
        if len(trail) > 1:
            self._angle = viewer_geometry.heading(*trail[-2:], width)
        place = viewer_geometry.cell_centers(trail[-1], width, self._cell)
        self._publish[viewer_messages.ROBOT](viewer_messages.pose(header, place, self._angle))
        self._publish[viewer_messages.TRAIL](viewer_messages.path(header, trail, width, self._cell))

    def _publish_returns(self, topic, view, field):
        """Publish each return of this run; of those that were latched, only the last."""
        msg = [each for each in self._returns[topic.name] if each.run == self.scene.run]
        self._returns[topic.name].clear()
        for each in msg if view in self._shown else msg[-1:]:
            self._publish[view](Float64(data=getattr(each, field)))
            self._shown.add(view)

    def _show_maps(self):
        """Publish the maps and markers that changed."""
        changed = self.scene.changed - {viewer_state.ROBOT}
        self.scene.changed -= changed
        if self.scene.world is None or not changed:
            return
        header = viewer_messages.header_of(self, self._frame)
        known = {name: self._map(name) for name in viewer_state.MAPS}
        if viewer_state.WORLD in changed:
            self._publish_world(header)
        if viewer_state.TRUST in changed:
            self._publish_trust(header, known[viewer_state.TRUST])
        if len(self.scene.world.free) > MOST_STATES:
            self._say_too_large()
            return
        if {viewer_state.TRUST, viewer_state.MENTOR} & changed:
            self._publish_mentor(header, known[viewer_state.MENTOR], known[viewer_state.TRUST])
        if viewer_state.POLICY in changed:
            self._publish_policy(header, known[viewer_state.POLICY])
        if viewer_state.VALUES in changed:
            self._publish_values(header, known[viewer_state.VALUES])

    def _map(self, name):
        """Return a map, None where there is none, or none that can be right."""
        try:
            return self.scene.map(name)
        except ValueError as error:
            self._tell((refused_map(name, error),))
            return None

    def _say_too_large(self):
        if 'too large' not in self._told:
            self._told.add('too large')
            self.get_logger().warning(f'a world must have at most {MOST_STATES} cells to be shown '
                                      f'with markers, got {len(self.scene.world.free)}: its maps '
                                      'are shown alone')

    def _publish_world(self, header):
        """Publish the map, and markers at goals and starts."""
        world, cell = self.scene.world, self._cell
        self._publish[viewer_messages.MAP](viewer_messages.occupancy_grid(
            header, world.grid, cell, viewer_geometry.occupancy(world)))
        goals = viewer_geometry.cell_centers(world.terminal.nonzero()[0], world.grid.width, cell)
        starts = viewer_geometry.cell_centers(world.starts, world.grid.width, cell)
        few = starts if len(starts) <= 16 else starts[:0]
        self._publish[viewer_messages.PLACES](viewer_messages.markers(
            viewer_messages.nothing(header),
            viewer_messages.marker(header, 'goals', Marker.SPHERE_LIST, goals, 0.0, GOLD,
                         (0.7 * cell, 0.7 * cell, 0.1 * cell)),
            viewer_messages.marker(header, 'starts', Marker.SPHERE_LIST, few, 0.0, BLUE,
                         (0.8 * cell, 0.8 * cell, 0.02 * cell))))

    def _publish_trust(self, header, trust):
        """Publish the trust map; all unknown where none was heard in this run."""
        world = self.scene.world
        percents = [viewer_geometry.UNKNOWN] * len(world.free) if trust is None else \
            viewer_geometry.trust_percent(world, trust)
        self._publish[viewer_messages.TRUST_MAP](
            viewer_messages.occupancy_grid(header, world.grid, self._cell, percents))

    def _publish_mentor(self, header, policy, trust):
        """Publish the mentor's arrows, green where it is trusted, red where not, else grey."""
        states, places = self._arrows(policy, viewer_geometry.ARROW_TRIANGLES)
        colours = GREY
        if trust is not None:
            colours = [TRUST_COLOURS[each] for each in viewer_geometry.percent(trust[states])
                       for _ in range(viewer_geometry.POINTS_PER_ARROW)]
        self._publish[viewer_messages.MENTOR](viewer_messages.markers(viewer_messages.marker(
            header, 'mentor', Marker.TRIANGLE_LIST, places, viewer_messages.ARROW_HEIGHT * self._cell,
            colours, (1.0, 1.0, 1.0))))

    def _publish_policy(self, header, policy):
        """Publish the learner's own arrows, as thin lines over those of the mentor."""
        _, places = self._arrows(policy, viewer_geometry.ARROW_LINES)
        self._publish[viewer_messages.POLICY](viewer_messages.markers(viewer_messages.marker(
            header, 'policy', Marker.LINE_LIST, places, 2 * viewer_messages.ARROW_HEIGHT * self._cell, INK,
            (0.05 * self._cell, 0.0, 0.0))))

    def _arrows(self, policy, shape):
        """Return the states with an arrow, and the corners of the arrows."""
        world = self.scene.world
        states = viewer_geometry.advised_states(world, viewer_geometry.NO_ACTION if policy is None else policy)
        actions = () if policy is None else policy[states]
        return states, viewer_geometry.arrow_points(states, actions, shape, world.grid.width, self._cell)

    def _publish_values(self, header, values):
        """Publish a tile in every state, the bluer the higher its value, and what that means."""
        if values is None:
            self._publish[viewer_messages.VALUES](viewer_messages.markers(viewer_messages.nothing(header)))
            return
        world, cell = self.scene.world, self._cell
        free = world.free.nonzero()[0]
        colours = [VALUE_COLOURS[each] for each in viewer_geometry.value_percent(world, values)]
        places = viewer_geometry.cell_centers(free, world.grid.width, cell)
        self._publish[viewer_messages.VALUES](viewer_messages.markers(
            viewer_messages.marker(header, 'values', Marker.CUBE_LIST, places, viewer_messages.TILE_HEIGHT * cell,
                         colours, (cell, cell, 0.01 * cell)),
            viewer_messages.caption(header, 'scale', 'values: white {:.3g}, blue {:.3g}'.format(
                values[free].min(), values[free].max()),
                (world.grid.width * cell / 2, -0.04 * world.grid.height * cell),
                0.03 * world.grid.height * cell)))

    def leave(self):
        """Do nothing: nothing is kept."""


def check_frame(frame):
    """
    Return if a frame can be one of REP 105.

    Raises
    ------
    ParameterError: if it is empty, or begins with a slash.

    """
    if not frame or frame.startswith('/'):
        raise ParameterError('parameter frame must be the name of a frame without a slash in '
                             f'front, such as map, got {frame!r}')


def main(argv):
    """Run the node; return the exit code."""
    return run_node(ViewerNode, argv, (ParameterError,))
