# SPDX-License-Identifier: Apache-2.0
"""What the viewer publishes: every topic with its message and QoS, and how messages are made."""

from dataclasses import dataclass
from math import cos, sin
from typing import Any

from geometry_msgs.msg import PoseStamped, TransformStamped, Vector3
from nav_msgs.msg import OccupancyGrid, Path
import numpy as np
from numpy.typing import ArrayLike, NDArray
from rclpy.qos import QoSProfile
from std_msgs.msg import Float64, Header
from visualization_msgs.msg import MarkerArray

from comply_ros.nodes.topics import LATCHED
from comply_ros.plots import viewer_geometry as geometry
from comply_ros.plots.viewer_geometry import StatePlaces
from comply_ros.world.mdp import World

SERIES = QoSProfile(depth=1000)  # a subscriber receives every number, a late one no old ones


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


def trust_view(mentor: str) -> View:
    """Return the topic with the map of the trust in one of several mentors."""
    return View(f'view/mentors/{mentor or "unnamed"}/trust', OccupancyGrid, LATCHED)


def map_message(header: Header, world: World, places: StatePlaces) -> OccupancyGrid:
    """Obstacles of a world that is a map."""
    return _occupancy_grid(header, places, geometry.occupancy(world, places))


def trust_message(header: Header, world: World, places: StatePlaces,
                  trust: ArrayLike | None) -> OccupancyGrid:
    """Confidence in every state, in percent; unknown everywhere before it was received."""
    percents = [geometry.UNKNOWN] * (places.columns * places.rows) if trust is None else \
        geometry.trust_percent(world, places, trust)
    return _occupancy_grid(header, places, percents)


def no_map_message(header: Header) -> OccupancyGrid:
    """Return a map without cells: it takes the place of one of another world."""
    return OccupancyGrid(header=header)


def _occupancy_grid(header: Header, places: StatePlaces, percents: list[int]) -> OccupancyGrid:
    """`OccupancyGrid` with a percentage for each cell; its origin is the lower left."""
    message = OccupancyGrid(header=header, data=percents)
    message.info.map_load_time = header.stamp
    message.info.resolution = places.side
    message.info.width, message.info.height = places.columns, places.rows
    message.info.origin.position.x, message.info.origin.position.y = places.corner
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


def trail_message(header: Header, trail: NDArray[np.float64]) -> Path:
    """`Path` through points `trail[i]` = (x, y) in metres."""
    return Path(header=header, poses=[pose_message(header, place, 0.0) for place in trail])
