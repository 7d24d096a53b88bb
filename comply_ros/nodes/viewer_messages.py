# SPDX-License-Identifier: Apache-2.0
"""What the viewer publishes: every topic with its message and QoS, and how messages are filled."""

from dataclasses import dataclass
from math import cos, sin

from geometry_msgs.msg import Point, PoseStamped
from nav_msgs.msg import OccupancyGrid, Path
from rclpy.qos import QoSProfile
from std_msgs.msg import ColorRGBA, Float64, Header
from visualization_msgs.msg import Marker, MarkerArray

from comply_ros.nodes.topics import LATCHED
from comply_ros.plots.trust_colors import palette
from comply_ros.plots.viewer_geometry import cell_centers

# A series of numbers: every one counts for who listens, and none for who comes late.
SERIES = QoSProfile(depth=1000)
ARROW_HEIGHT, TILE_HEIGHT = 0.02, 0.01  # cells above the map


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


def occupancy_grid(header, grid, cell, percents):
    """`OccupancyGrid` of a list of percentages, one a state; its origin is the lower left."""
    message = OccupancyGrid(header=header, data=percents)
    message.info.map_load_time = header.stamp
    message.info.resolution = cell
    message.info.width, message.info.height = grid.width, grid.height
    message.info.origin.orientation.w = 1.0
    return message


def pose(header, place, angle):
    """`PoseStamped` at (x, y) in metres, turned by an angle in radians."""
    message = PoseStamped(header=header)
    message.pose.position.x, message.pose.position.y = (float(each) for each in place)
    message.pose.orientation.z, message.pose.orientation.w = sin(angle / 2), cos(angle / 2)
    return message


def path(header, states, width, cell):
    """`Path` through the middles of states."""
    places = cell_centers(states, width, cell) if states else ()
    return Path(header=header, poses=[pose(header, place, 0.0) for place in places])


def markers(*those):
    """`MarkerArray` of them."""
    return MarkerArray(markers=list(those))


def marker(header, namespace, kind, places, height, colours, scale):
    """
    `Marker` of many points at once; of no points, one that takes the last one away.

    places: `p[i]` = (x, y) in metres; height: z in metres.
    colours: one `ColorRGBA`, or a list with one for each point.
    scale: (x, y, z) in metres.

    """
    message = Marker(header=header, ns=namespace, type=kind, frame_locked=True)
    message.action = Marker.ADD if len(places) else Marker.DELETE
    message.pose.orientation.w = 1.0
    message.scale.x, message.scale.y, message.scale.z = scale
    message.points = [Point(x=x, y=y, z=height) for x, y in places.tolist()]
    if isinstance(colours, list):
        message.colors, message.color = colours, rgba((1.0, 1.0, 1.0))
    else:
        message.color = colours
    return message


def caption(header, namespace, text, place, size):
    """`Marker` with one line of text at (x, y) in metres; size: its height in metres."""
    message = Marker(header=header, ns=namespace, id=1, type=Marker.TEXT_VIEW_FACING, text=text,
                     color=rgba((0.5, 0.5, 0.5)), frame_locked=True)
    message.pose.position.x, message.pose.position.y = place
    message.pose.orientation.w, message.scale.z = 1.0, size
    return message


def nothing(header):
    """`Marker` that takes all of its topic away."""
    return Marker(header=header, action=Marker.DELETEALL)


def rgba(colour, alpha=1.0):
    """`ColorRGBA` of (red, green, blue) in [0, 1]."""
    red, green, blue = (float(each) for each in colour)
    return ColorRGBA(r=red, g=green, b=blue, a=alpha)


def colours_of(scale, alpha=1.0):
    """List of `ColorRGBA` for 0 to 100 percent of a scale."""
    return [rgba(each, alpha) for each in palette(scale)]


def header_of(node, frame):
    """`Header` with the time of now."""
    return Header(stamp=node.get_clock().now().to_msg(), frame_id=frame)
