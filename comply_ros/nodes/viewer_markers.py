# SPDX-License-Identifier: Apache-2.0
"""The markers of the viewer: ends and starts, actions, trust and values, in any world."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from geometry_msgs.msg import Point
import numpy as np
from numpy.typing import NDArray
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

from comply_ros.plots import viewer_geometry as geometry
from comply_ros.plots.mentor_marks import (
    legend_text,
    mentor_color,
    mentor_spots,
    opacity,
    Spot,
)
from comply_ros.plots.state_layout import goals_of, short_name
from comply_ros.plots.trust_colors import palette, TRUST_PALETTE
from comply_ros.plots.viewer_geometry import StatePlaces
from comply_ros.protocol.state_maps import MentorReports
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.mdp import World

MAX_STARTS = 16  # that are marked: where a robot starts anywhere, marks tell nothing
MAX_NAMES = 5000  # names of actions that are written: each is a marker of its own
# In sides of a cell.
VALUE_HEIGHT, TRUST_HEIGHT, ARROW_HEIGHT, NAME_HEIGHT = 0.01, 0.015, 0.02, 0.06  # above the map
TRUST_SIDE = 0.8  # of a tile: that of the value around it stays visible
NAME_SIZE = 0.36
SMALLER = 0.5  # arrows above a tile: there is one of the mentor and one of the learner in it

Colors = ColorRGBA | list[ColorRGBA]  # one for all states, or `c[s]`


def color(rgb: Sequence[float], alpha: float = 1.0) -> ColorRGBA:
    """`ColorRGBA` of (red, green, blue) in [0, 1]."""
    red, green, blue = (float(each) for each in rgb)
    return ColorRGBA(r=red, g=green, b=blue, a=alpha)


WHITE, GREY, INK = (color((share,) * 3) for share in (1.0, 0.6, 0.13))
GOLD, BLUE = color((0.9, 0.62, 0.0)), color((0.0, 0.45, 0.7), 0.35)
DARK_BLUE = color((0.0, 0.2, 0.5))
# By percent: from no confidence to full, and from the lowest value to the highest.
TRUST_COLORS = [color(each) for each in TRUST_PALETTE]
VALUE_COLORS = [color(each, 0.85) for each in palette(geometry.VALUE_SCALE)]


class Pen(NamedTuple):
    """
    How the actions of a policy are drawn.

    Attributes
    ----------
    name: namespace of the markers.
    kind, shape: of the arrows.
    width: of their lines, in sides of a cell; None for triangles.
    height: in sides of a cell.
    shift: where the names are, and arrows above a tile: how far above the middle of the cell.
    spot: the part of the cell that it has.

    """

    name: str
    kind: int
    shape: geometry.Shape
    width: float | None
    height: float
    shift: float
    spot: Spot = Spot(0.0, 0.0, 1.0)


MENTOR_PEN = Pen('mentor', Marker.TRIANGLE_LIST, geometry.ARROW_TRIANGLES, None, ARROW_HEIGHT,
                 0.2)
LEARNER_PEN = Pen('policy', Marker.LINE_LIST, geometry.ARROW_LINES, 0.05, 2 * ARROW_HEIGHT, -0.2)


def places_message(header: Header, world: World, places: StatePlaces) -> MarkerArray:
    """Golden spheres at goals, dark ones at other ends, and blue discs at starts if few."""
    side, goals = places.side, goals_of(world)
    few = world.starts if len(world.starts) <= MAX_STARTS else world.starts[:0]
    ends, disc = (0.7 * side, 0.7 * side, 0.1 * side), (0.8 * side, 0.8 * side, 0.02 * side)
    return MarkerArray(markers=[_removal(header)] + [
        _marker(header, name, Marker.SPHERE_LIST, places.centers(states), 0.0, look, scale)
        for name, states, look, scale in (
            ('goals', np.flatnonzero(goals), GOLD, ends),
            ('pits', np.flatnonzero(world.terminal & ~goals), INK, ends),
            ('starts', few, BLUE, disc))])


def mentor_message(header: Header, world: World, places: StatePlaces,
                   policy: NDArray[Any] | None, trust: NDArray[Any] | None,
                   learned: NDArray[Any] | None) -> MarkerArray:
    """
    Actions of the mentor: green where the learner trusts it, red where not, else grey.

    Where there is no map of the trust, a tile or a sphere for each state has these colors.

    learned: the learner's policy, -1 in states where it was never.
    """
    colors = _trust_colors(trust, learned)
    if places.is_map:
        return MarkerArray(markers=[
            _removal(header), *_actions(header, world, places, policy, MENTOR_PEN, colors)])
    tiles = _tiles(header, 'trust', world, places, TRUST_SIDE, TRUST_HEIGHT,
                   _each(colors, np.flatnonzero(world.free)))
    return MarkerArray(
        markers=[_removal(header),
                 *_actions(header, world, places, policy, MENTOR_PEN, INK), tiles])


def _trust_colors(trust: NDArray[Any] | None, learned: NDArray[Any] | None) -> Colors:
    """Return the color of the trust in each state, or grey for all while it is not known."""
    return GREY if trust is None or learned is None else [
        GREY if action == NO_ACTION else TRUST_COLORS[percent]
        for percent, action in zip(geometry.percent(trust), learned)]


def mentors_message(header: Header, world: World, places: StatePlaces,
                    mentors: Mapping[str, MentorReports], learned: NDArray[Any] | None,
                    ) -> MarkerArray:
    """
    Actions of several mentors, each in its own color: the fainter, the less it is trusted.

    They are grey where the learner was never. A legend has the names, and the confidence in each.
    Where there is no map of the trust, a tile for each state has the color of the largest one.
    """
    markers = [_removal(header)]
    for m, (spot, (name, known)) in enumerate(zip(mentor_spots(len(mentors)), mentors.items())):
        pen = MENTOR_PEN._replace(name=f'mentor {name}'.rstrip(), spot=spot)
        own = list(bytes.fromhex(mentor_color(m)[1:]))
        markers += _actions(header, world, places, known.policy, pen,
                            _faded([each / 255 for each in own], known.trust, learned))
        markers.append(_legend_line(header, places, m, legend_text(name, known.confidence),
                                    color([each / 255 for each in own])))
    if not places.is_map:
        trust = largest_trust(mentors)
        markers.append(_tiles(
            header, 'trust', world, places, TRUST_SIDE, TRUST_HEIGHT,
            _each(_trust_colors(trust, learned), np.flatnonzero(world.free))))
    return MarkerArray(markers=markers)


def largest_trust(mentors: Mapping[str, MentorReports]) -> NDArray[Any] | None:
    """`p[s]` in the mentor that is trusted most in state s; None where no trust is known."""
    known = [each.trust for each in mentors.values() if each.trust is not None]
    return np.max(known, axis=0) if known else None


def _faded(rgb: Sequence[float], trust: NDArray[Any] | None,
           learned: NDArray[Any] | None) -> Colors:
    """Return a color for each state, by the trust in it; grey where nothing is known."""
    if trust is None or learned is None:
        return GREY
    shades = [color(rgb, opacity(percent / 100)) for percent in range(101)]
    return [GREY if action == NO_ACTION else shades[percent]
            for percent, action in zip(geometry.percent(trust), learned)]


def _legend_line(header: Header, places: StatePlaces, m: int, text: str,
                 look: ColorRGBA) -> Marker:
    """Return line m of the legend, which is above the picture, from its left side on."""
    (x, y), height = places.corner, places.rows * places.side
    size = 0.04 * height
    return _text(header, 'mentors', m, (x + 0.15 * places.columns * places.side,
                                        y + height + (1.2 + 1.3 * m) * size), 0.0, text, look,
                 size)


def policy_message(header: Header, world: World, places: StatePlaces,
                   policy: NDArray[Any] | None) -> MarkerArray:
    """Actions of the learner's own policy, as thin lines above those of the mentor."""
    return MarkerArray(markers=[
        _removal(header), *_actions(header, world, places, policy, LEARNER_PEN,
                                    INK if places.is_map else DARK_BLUE)])


def values_message(header: Header, world: World, places: StatePlaces,
                   values: NDArray[np.float64] | None) -> MarkerArray:
    """Return a tile in every state, the bluer the higher its value, and what the colors mean."""
    if values is None:
        return MarkerArray(markers=[_removal(header)])
    free, (x, y) = values[world.free], places.corner
    width, height = places.columns * places.side, places.rows * places.side
    caption = _text(header, 'scale', 1, (x + width / 2, y - 0.04 * height), 0.0,
                    f'values: white {free.min():.3g}, blue {free.max():.3g}',
                    color((0.5, 0.5, 0.5)), 0.03 * height)
    colors = [VALUE_COLORS[percent] for percent in geometry.value_percent(world, values)]
    return MarkerArray(markers=[
        _tiles(header, 'values', world, places, 1.0, VALUE_HEIGHT, colors), caption])


def _actions(header: Header, world: World, places: StatePlaces, policy: NDArray[Any] | None,
             pen: Pen, colors: Colors) -> list[Marker]:
    """Return arrows for actions that are directions, and the short names of the others."""
    policy = np.full(world.n_states, NO_ACTION) if policy is None else policy
    turned, named = geometry.arrow_and_name_states(world, policy)
    room, (right, up, share) = places.side if places.is_map else SMALLER * places.side, pen.spot
    side, shift = share * room, np.array((right * room, up * room + pen.shift * places.side))
    moved = (right * room, up * room) if places.is_map else shift
    points = geometry.arrow_points(
        places.centers(turned) + moved, [world.action_names[a] for a in policy[turned]],
        pen.shape, side)
    arrows = _marker(header, pen.name, pen.kind, points, pen.height * places.side,
                     _each(colors, turned, geometry.POINTS_PER_ARROW),
                     (1.0, 1.0, 1.0) if pen.width is None else (pen.width * side, 0.0, 0.0))
    named = named if len(named) <= MAX_NAMES else named[:0]
    names = [_text(header, f'{pen.name} names', s, place, NAME_HEIGHT * places.side,
                   short_name(world.action_names[policy[s]]),
                   colors[s] if isinstance(colors, list) else colors,
                   NAME_SIZE * share * places.side)
             for s, place in zip(named.tolist(), places.centers(named) + shift)]
    return [arrows, *names]


def _each(colors: Colors, states: NDArray[np.int64], count: int = 1) -> Colors:
    """Return the colors of so many points in each of the states."""
    if isinstance(colors, list):
        return [colors[s] for s in states.tolist() for _ in range(count)]
    return colors


def _tiles(header: Header, namespace: str, world: World, places: StatePlaces, share: float,
           height: float, colors: Colors) -> Marker:
    """Return a tile in every free state, a sphere where places are no cells; share: of a cell."""
    side = share * places.side
    kind = Marker.SPHERE_LIST if places.are_scattered else Marker.CUBE_LIST
    return _marker(header, namespace, kind, places.centers(np.flatnonzero(world.free)),
                   height * places.side, colors, (side, side, 0.01 * places.side))


def _removal(header: Header) -> Marker:
    """Return a marker that removes all markers of its topic that came before it."""
    return Marker(header=header, action=Marker.DELETEALL)


def _text(header: Header, namespace: str, number: int, place: Sequence[float], height: float,
          text: str, look: ColorRGBA, size: float) -> Marker:
    """Return a text at (x, y); height: z of its middle. size: of its letters, in metres."""
    message = Marker(header=header, ns=namespace, id=number, type=Marker.TEXT_VIEW_FACING,
                     frame_locked=True, color=look, text=text)
    x, y = place
    position = message.pose.position
    position.x, position.y, position.z = float(x), float(y), height
    message.pose.orientation.w, message.scale.z = 1.0, size
    return message


def _marker(header: Header, namespace: str, kind: int, points: NDArray[np.float64],
            height: float, colors: Colors, scale: tuple[float, float, float]) -> Marker:
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
