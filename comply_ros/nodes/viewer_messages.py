# SPDX-License-Identifier: Apache-2.0
"""What the viewer publishes: every topic with its message and QoS, and how messages are made."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, sin
from typing import Any

from geometry_msgs.msg import Point, PoseStamped, TransformStamped, Vector3
from nav_msgs.msg import OccupancyGrid, Path
import numpy as np
from numpy.typing import ArrayLike, NDArray
from rclpy.qos import QoSProfile
from std_msgs.msg import ColorRGBA, Float64, Header
from visualization_msgs.msg import Marker, MarkerArray

from comply_ros.nodes.topics import LATCHED
from comply_ros.plots import viewer_geometry as geometry
from comply_ros.plots.trust_colors import palette, TRUST_PALETTE
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.mdp import World

SERIES = QoSProfile(depth=1000)  # a subscriber receives every number, a late one no old ones
ARROW_HEIGHT, TILE_HEIGHT = 0.02, 0.01  # cells above the map
MAX_STARTS = 16  # that are marked: where a robot starts anywhere, marks tell nothing


@dataclass(frozen=True, eq=False)
class View:
    """A topic of the viewer: its relative name, the message, its QoS."""

    name: str
    message: type
    qos: QoSProfile


MAP = View('view/map', OccupancyGrid, LATCHED)
TRUST_MAP = View('view/trust', OccupancyGrid, LATCHED)
ROBOT = View('view/robot', PoseStamped, LATCHED)
TRAIL = View('view/trail', Path, LATCHED)
PLACES = View('view/places', MarkerArray, LATCHED)
MENTOR = View('view/mentor', MarkerArray, LATCHED)
POLICY = View('view/policy', MarkerArray, LATCHED)
VALUES = View('view/values', MarkerArray, LATCHED)
EPISODE_RETURN = View('view/episode_return', Float64, SERIES)
MEAN_RETURN = View('view/mean_return', Float64, SERIES)
VIEWS = (MAP, TRUST_MAP, ROBOT, TRAIL, PLACES, MENTOR, POLICY, VALUES, EPISODE_RETURN,
         MEAN_RETURN)


def color(rgb: Sequence[float], alpha: float = 1.0) -> ColorRGBA:
    """`ColorRGBA` of (red, green, blue) in [0, 1]."""
    red, green, blue = (float(each) for each in rgb)
    return ColorRGBA(r=red, g=green, b=blue, a=alpha)


WHITE, GREY, INK = (color((share,) * 3) for share in (1.0, 0.6, 0.13))
GOLD, BLUE = color((0.9, 0.62, 0.0)), color((0.0, 0.45, 0.7), 0.35)
# By percent: from no confidence to full, and from the lowest value to the highest.
TRUST_COLORS = [color(each) for each in TRUST_PALETTE]
VALUE_COLORS = [color(each, 0.85) for each in palette(geometry.VALUE_SCALE)]


def map_message(header: Header, world: World, cell: float) -> OccupancyGrid:
    """Obstacles of a world; cell: the side of a cell in metres, as below."""
    return _occupancy_grid(header, world, cell, geometry.occupancy(world))


def trust_message(header: Header, world: World, cell: float,
                  trust: ArrayLike | None) -> OccupancyGrid:
    """Confidence in every state, in percent; unknown everywhere before it was received."""
    percents = [geometry.UNKNOWN] * len(world.free) if trust is None else \
        geometry.trust_percent(world, trust)
    return _occupancy_grid(header, world, cell, percents)


def _occupancy_grid(header: Header, world: World, cell: float,
                    percents: list[int]) -> OccupancyGrid:
    """`OccupancyGrid` with one percentage for each state; its origin is the lower left."""
    message = OccupancyGrid(header=header, data=percents)
    message.info.map_load_time = header.stamp
    message.info.resolution = cell
    message.info.width, message.info.height = world.grid.width, world.grid.height
    message.info.origin.orientation.w = 1.0
    return message


def pose_message(header: Header, place: ArrayLike, angle: float) -> PoseStamped:
    """`PoseStamped` at (x, y) in metres, turned by an angle in radians."""
    message = PoseStamped(header=header)
    message.pose.position.x, message.pose.position.y = np.asarray(place, dtype=float).tolist()
    message.pose.orientation.z, message.pose.orientation.w = sin(angle / 2), cos(angle / 2)
    return message


def tf_message(kind: type, pose: PoseStamped, frame: str) -> Any:
    """
    Message on `/tf` with the transform from the frame of a pose to that of the robot in it.

    kind: `tf2_msgs.msg.TFMessage`, or a class with the same field.
    frame: of the robot.
    """
    transform = TransformStamped(header=pose.header, child_frame_id=frame)
    place = pose.pose.position
    transform.transform.translation = Vector3(x=place.x, y=place.y, z=place.z)
    transform.transform.rotation = pose.pose.orientation
    return kind(transforms=[transform])


def trail_message(header: Header, states: Sequence[int], world: World, cell: float) -> Path:
    """`Path` through the centers of states."""
    places = geometry.cell_centers(states, world.grid.width, cell) if states else ()
    return Path(header=header, poses=[pose_message(header, place, 0.0) for place in places])


def places_message(header: Header, world: World, cell: float) -> MarkerArray:
    """Golden spheres at goals, and blue discs at starts if they are few."""
    width = world.grid.width
    goals = geometry.cell_centers(world.terminal.nonzero()[0], width, cell)
    starts = geometry.cell_centers(world.starts, width, cell)
    few = starts if len(starts) <= MAX_STARTS else starts[:0]
    return MarkerArray(markers=[
        Marker(header=header, action=Marker.DELETEALL),
        _marker(header, 'goals', Marker.SPHERE_LIST, goals, 0.0, GOLD,
                (0.7 * cell, 0.7 * cell, 0.1 * cell)),
        _marker(header, 'starts', Marker.SPHERE_LIST, few, 0.0, BLUE,
                (0.8 * cell, 0.8 * cell, 0.02 * cell))])


def mentor_message(header: Header, world: World, cell: float, policy: NDArray[Any] | None,
                   trust: NDArray[Any] | None, learned: NDArray[Any] | None) -> MarkerArray:
    """
    Arrows of the mentor: green where the learner trusts it, red where not, else grey.

    learned: the learner's policy, -1 in states where it was never.
    """
    states, points = _arrows(world, cell, policy, geometry.ARROW_TRIANGLES)
    colors = GREY if trust is None or learned is None else [
        GREY if action == NO_ACTION else TRUST_COLORS[percent]
        for percent, action in zip(geometry.percent(trust[states]), learned[states])
        for _ in range(geometry.POINTS_PER_ARROW)]
    return MarkerArray(markers=[_marker(header, 'mentor', Marker.TRIANGLE_LIST, points,
                                        ARROW_HEIGHT * cell, colors, (1.0, 1.0, 1.0))])


def policy_message(header: Header, world: World, cell: float,
                   policy: NDArray[Any] | None) -> MarkerArray:
    """Arrows of the learner's own policy, as thin lines above those of the mentor."""
    _, points = _arrows(world, cell, policy, geometry.ARROW_LINES)
    return MarkerArray(markers=[_marker(header, 'policy', Marker.LINE_LIST, points,
                                        2 * ARROW_HEIGHT * cell, INK, (0.05 * cell, 0.0, 0.0))])


def _arrows(world: World, cell: float, policy: NDArray[Any] | None,
            shape: Any) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return the states with an arrow, and the points of the arrows."""
    states = geometry.advised_states(world, NO_ACTION if policy is None else policy)
    actions = () if policy is None else policy[states]
    return states, geometry.arrow_points(states, actions, shape, world.grid.width, cell)


def values_message(header: Header, world: World, cell: float,
                   values: NDArray[np.float64] | None) -> MarkerArray:
    """Return a tile in every state, the bluer the higher its value, and what the colors mean."""
    if values is None:
        return MarkerArray(markers=[Marker(header=header, action=Marker.DELETEALL)])
    grid, free = world.grid, world.free.nonzero()[0]
    caption = Marker(
        header=header, ns='scale', id=1, type=Marker.TEXT_VIEW_FACING, frame_locked=True,
        color=color((0.5, 0.5, 0.5)),
        text=f'values: white {values[free].min():.3g}, blue {values[free].max():.3g}')
    caption.pose.position.x = grid.width * cell / 2
    caption.pose.position.y = -0.04 * grid.height * cell
    caption.pose.orientation.w, caption.scale.z = 1.0, 0.03 * grid.height * cell
    return MarkerArray(markers=[
        _marker(header, 'values', Marker.CUBE_LIST, geometry.cell_centers(free, grid.width, cell),
                TILE_HEIGHT * cell,
                [VALUE_COLORS[percent] for percent in geometry.value_percent(world, values)],
                (cell, cell, 0.01 * cell)), caption])


def _marker(header: Header, namespace: str, kind: int, points: NDArray[np.float64],
            height: float, colors: ColorRGBA | list[ColorRGBA],
            scale: tuple[float, float, float]) -> Marker:
    """
    `Marker` of many points (x, y) at once; of no points, one that removes the last one.

    height: z of the points in metres.
    colors: one for all points, or a list with one for each point.
    scale: (x, y, z) in metres.

    """
    message = Marker(header=header, ns=namespace, type=kind, frame_locked=True)
    message.action = Marker.ADD if len(points) else Marker.DELETE
    message.pose.orientation.w = 1.0
    message.scale.x, message.scale.y, message.scale.z = scale
    message.points = [Point(x=x, y=y, z=height) for x, y in points.tolist()]
    if isinstance(colors, list):
        message.colors, message.color = colors, WHITE
    else:
        message.color = colors
    return message
