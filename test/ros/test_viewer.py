# SPDX-License-Identifier: Apache-2.0
"""The viewer as a real process beside the three, and the files that show what it publishes."""

import ast
import json
import os
from pathlib import Path
import re
import signal

from node_processes import log_has, nodes, run
import numpy as np
import pytest
from short_training import digest_of, LEARNER, MENTOR, received, SMALL, spin_until, trained
from std_msgs.msg import Header
from visualization_msgs.msg import Marker
from waiting import wait_until
import yaml

from comply_ros.nodes import topics, viewer_messages
from comply_ros.plots.viewer_geometry import (
    advised_states,
    occupancy,
    places_of,
    POINTS_PER_ARROW,
)
from comply_ros.storage.map_files import read_map
from comply_ros.storage.mentor_cache import mentor_policy, read_mentor_spec
from comply_ros.world.mdp import World

pytestmark = pytest.mark.usefixtures('domain')
TOP = Path(__file__).parents[2]
VIEWER = ('-p', 'map_rate:=20.0', '-p', 'robot_rate:=50.0', '-p', 'cell_size:=0.5')


@pytest.mark.long
def test_everything_is_shown_and_the_digest_is_the_same(tmp_path, node):
    seen = {view: received(node, view) for view in viewer_messages.VIEWS}
    trust, values, episodes, progress = (received(node, topic) for topic in (
        topics.TRUST, topics.VALUES, topics.EPISODE, topics.PROGRESS))
    with nodes(tmp_path, viewer=VIEWER, grid_world=SMALL, mentor=MENTOR) as started:
        wait_until(log_has(started['viewer'], 'shows world'), 'viewer')  # before there is much
        with nodes(tmp_path / 'learner', learner=LEARNER) as learners:
            assert digest_of(learners['learner']) == trained(iterations=4)
            spin_until(node, lambda: all(seen.values()) and len(progress) == 4
                       and len(episodes) >= 20
                       and seen[viewer_messages.MENTOR][-1].markers[-1].colors
                       and seen[viewer_messages.MEAN_RETURN][-1].data == progress[-1].mean_return
                       and shows(seen, trust, values), 'views of the last maps')
    world = World(read_map('bar_grid', 'published'))
    grid, policy = world.grid, mentor_policy(read_mentor_spec('noisy:0.3'), world, 0)
    shown = seen[viewer_messages.MAP][-1]
    assert list(shown.data) == occupancy(world, places_of(world, 0.5))
    assert (shown.info.width, shown.info.height) == (grid.width, grid.height)
    assert (shown.info.resolution, shown.header.frame_id) == (0.5, 'map')
    _, arrows = seen[viewer_messages.MENTOR][-1].markers
    assert arrows.type == Marker.TRIANGLE_LIST
    assert len(arrows.points) == len(arrows.colors) == \
        POINTS_PER_ARROW * len(advised_states(world, policy))
    returns = {msg.total_reward for msg in episodes}
    assert returns.issuperset(msg.data for msg in seen[viewer_messages.EPISODE_RETURN])
    place = seen[viewer_messages.ROBOT][-1].pose.position
    assert (place.x % 0.5, place.y % 0.5) == (0.25, 0.25)
    assert 'rejected' not in started['viewer'].log.read_text()


def shows(seen, trust, values):
    """Tell whether the last trust map and the last values are those of the learner."""
    world = World(read_map('bar_grid', 'published'))
    if not trust or not values or not seen[viewer_messages.VALUES][-1].markers[0].points:
        return False
    percents = np.rint(100.0 * np.array(trust[-1].confidence))
    expected = np.where(world.free, percents, -1).tolist()
    there = np.array(values[-1].value)[world.free]
    return list(seen[viewer_messages.TRUST_MAP][-1].data) == expected and (
        f'white {there.min():.3g}, blue {there.max():.3g}'
        in seen[viewer_messages.VALUES][-1].markers[1].text)


def test_a_world_without_a_map_is_shown_by_its_states(tmp_path, node):
    maps = [received(node, each) for each in (viewer_messages.MAP, viewer_messages.TRUST_MAP)]
    seen = {each: received(node, each) for each in (
        viewer_messages.MENTOR, viewer_messages.PLACES, viewer_messages.ROBOT)}
    with nodes(tmp_path, viewer=VIEWER, grid_world=('-p', 'map:=taxi'),
               mentor=('-p', 'mentor:=optimal')) as started:
        spin_until(node, lambda: all(seen.values())
                   and len(seen[viewer_messages.MENTOR][-1].markers) > 3, 'views of a taxi')
    world = World(read_map('taxi', 'published'))
    by_name = {marker.ns: marker for marker in seen[viewer_messages.MENTOR][-1].markers}
    assert set(by_name) == {'', 'mentor', 'mentor names', 'trust'}
    assert len(by_name['trust'].points) == world.free.sum()
    assert by_name['mentor names'].text in ('pu', 'do')
    place = seen[viewer_messages.ROBOT][-1].pose.position
    assert (place.x % 0.5, place.y % 0.5) == (0.25, 0.25)
    assert maps == [[], []]
    assert 'rejected' not in started['viewer'].log.read_text()


def test_a_viewer_that_hangs_stops_no_other_node(tmp_path):
    with nodes(tmp_path, viewer=VIEWER, grid_world=SMALL) as watched:
        wait_until(log_has(watched['viewer'], 'shows world'), 'viewer')
        os.kill(watched['viewer'].pid, signal.SIGSTOP)
        try:
            with nodes(tmp_path, mentor=MENTOR, learner=LEARNER) as started:
                assert digest_of(started['learner']) == trained(iterations=4)
        finally:
            os.kill(watched['viewer'].pid, signal.SIGCONT)


@pytest.mark.parametrize('wrong, message', [
    ('frame:=/map', "parameter frame must be the name of a frame without a slash in front, such "
     "as map, got '/map'"),
    ('cell_size:=0.0', 'parameter cell_size must lie in [0.001, 1000], got 0.0'),
    ('map_rate:=often', "parameter map_rate must be a double such as 1.0, got 'often'")])
@pytest.mark.long
def test_an_invalid_parameter_is_named(wrong, message):
    done = run('viewer', '--ros-args', '-p', wrong)
    assert (done.returncode, done.stderr) == (2, f'viewer: {message}\n')


def test_rviz_shows_what_the_viewer_publishes_and_nothing_else():
    content = yaml.safe_load((TOP / 'rviz' / 'teach.rviz').read_text())['Visualization Manager']
    kinds = {'OccupancyGrid': 'Map', 'PoseStamped': 'Pose', 'Path': 'Path',
             'MarkerArray': 'MarkerArray'}
    expected = {f'/{view.name}': f'rviz_default_plugins/{kinds[view.message.__name__]}'
                for view in viewer_messages.VIEWS if view.message.__name__ in kinds}
    shown = {each['Topic']['Value']: each['Class'] for each in content['Displays']}
    assert shown == expected
    assert content['Global Options']['Fixed Frame'] == 'map'
    assert {each['Topic']['Durability Policy'] for each in content['Displays']} == {
        'Transient Local'}


def test_foxglove_shows_what_the_viewer_publishes_and_nothing_else():
    content = json.loads((TOP / 'config' / 'teach.foxglove.json').read_text())
    panels, shown = content['configById'], set()
    for name, panel in panels.items():
        shown |= set(panel['topics'] if name.startswith('3D!') else
                     (each['value'].removesuffix('.data') for each in panel['paths']))
    assert shown == {f'/{view.name}' for view in viewer_messages.VIEWS}
    assert set(re.findall(r"'(\w+!\w+)'", repr(content['layout']))) == set(panels)


def test_the_launch_file_knows_what_rviz_shows():
    tables = {each.targets[0].id: each.value for each in ast.parse(
        (TOP / 'launch' / 'teach.launch.py').read_text()).body if isinstance(each, ast.Assign)}
    assert {f'view/{each}' for each in ast.literal_eval(tables['VIEW_TOPICS'])} == {
        view.name for view in viewer_messages.VIEWS if 'return' not in view.name}


class TransformList:
    """The shape of `tf2_msgs/msg/TFMessage`, which is on no registry."""

    def __init__(self, transforms):
        self.transforms = transforms


def test_the_transform_of_the_robot_is_its_pose():
    pose = viewer_messages.pose_message(Header(frame_id='map'), (1.5, 2.5), np.pi / 2)
    transform, = viewer_messages.tf_message(TransformList, pose, 'robot').transforms
    assert (transform.header.frame_id, transform.child_frame_id) == ('map', 'robot')
    assert (transform.transform.translation.x, transform.transform.translation.y,
            transform.transform.translation.z) == (1.5, 2.5, 0.0)
    assert transform.transform.rotation == pose.pose.orientation
    assert abs(transform.transform.rotation.z - np.sqrt(0.5)) < 1e-12


@pytest.mark.parametrize('name, value', [('frame', ''), ('frame', '/map'), ('robot_frame', '/r')])
def test_a_frame_has_no_slash_in_front(name, value):
    done = run('viewer', '--ros-args', '-p', f"{name}:='{value}'")
    assert done.returncode == 2
    assert done.stderr == (f'viewer: parameter {name} must be the name of a frame without a slash '
                           f'in front, such as map, got {value!r}\n')
