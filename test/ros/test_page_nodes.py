# SPDX-License-Identifier: Apache-2.0
"""Which nodes the page shows and controls, whatever they are called."""

import asyncio
from concurrent.futures import ThreadPoolExecutor

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from node_processes import nodes
import pytest
import rclpy
from ros_client import ros_client
from waiting import wait_until

from comply_ros.dashboard.dashboard_node import DashboardNode, MAX_OTHER_NODES
from comply_ros.dashboard.header_bar import alarm_text, run_state_text
from comply_ros.dashboard.health_panel import health_text
from comply_ros.dashboard.service_client import ServiceCallError
from comply_ros.nodes.topics import ACTION, RECOMMENDATION, topic_of_mentor, WORLD


@pytest.fixture
def dashboard(domain):
    """Give the node of a page, in the default context."""
    rclpy.init()
    node = DashboardNode()
    yield node
    node.close()
    node.destroy_node()
    rclpy.shutdown()


def status(name):
    return DiagnosticStatus(level=DiagnosticStatus.OK, name=name, message='runs ' * 1000)


def test_only_nodes_of_this_lesson_have_a_row_and_not_too_many(dashboard):
    with ros_client() as client:
        publisher = client.create_publisher(DiagnosticArray, '/diagnostics', 10)
        ours = [rclpy.create_node(f'world_{number}', context=client.context)
                for number in range(MAX_OTHER_NODES + 5)]
        for node in ours:
            node.create_publisher(WORLD.message, WORLD.name, WORLD.qos)
        crowd = [status(f'stranger_{number}') for number in range(300)]

        def shown():
            publisher.publish(DiagnosticArray(status=[
                *crowd, *(status(node.get_name()) for node in ours), status('learner')]))
            dashboard.update()
            return dashboard.page_state.nodes
        client.until(lambda: len(shown()) == MAX_OTHER_NODES + 2, 'rows')
        rows = shown()
        assert not [name for name in rows if name.startswith('stranger')]
        assert 'learner' in rows and all(len(each.message) <= 200 for each in rows.values())
        for node in ours:
            node.destroy_node()


def updated(dashboard, condition, what):
    """Update a dashboard until a condition of its state is true; return the state."""
    wait_until(lambda: (dashboard.update(), condition(dashboard.page_state))[1], what)
    return dashboard.page_state


def test_a_mentor_that_sends_no_status_is_heard_while_it_publishes(dashboard):
    with ros_client() as client:
        mentor = rclpy.create_node('pointer', context=client.context)
        mentor.create_publisher(RECOMMENDATION.message, RECOMMENDATION.name, RECOMMENDATION.qos)
        state = updated(dashboard, lambda state: state.other_mentors == 1,
                        'mentor without a status')
        assert state.mentor_names == ('',) and state.is_name_shared
        mentor.destroy_node()
        updated(dashboard, lambda state: state.other_mentors == 0, 'end of the mentor')


def test_a_mentor_with_a_status_counts_once(dashboard):
    with ros_client() as client:
        mentor = rclpy.create_node('pointer', context=client.context)
        mentor.create_publisher(RECOMMENDATION.message, RECOMMENDATION.name, RECOMMENDATION.qos)
        publisher = client.create_publisher(DiagnosticArray, '/diagnostics', 10)
        wait_until(lambda: (publisher.publish(DiagnosticArray(status=[status('pointer')])),
                            dashboard.update(), 'pointer' in dashboard.page_state.nodes)[2],
                   'status')
        assert dashboard.page_state.other_mentors == 1
        mentor.destroy_node()


def test_mentors_with_names_are_found_and_have_the_role_of_a_mentor(dashboard):
    with ros_client() as client:
        mentors = []
        for name in ('anna', 'bob', 'bob'):
            topic = topic_of_mentor(RECOMMENDATION, name)
            mentors.append(rclpy.create_node(f'of_{len(mentors)}', context=client.context))
            mentors[-1].create_publisher(topic.message, topic.name, topic.qos)
        state = updated(dashboard, lambda state: state.is_name_shared
                        and state.mentor_names == ('anna', 'bob') and state.other_mentors == 3,
                        'three mentors')
        assert state.roles['mentor'].is_publishing
        mentors.pop().destroy_node()
        updated(dashboard, lambda state: not state.is_name_shared and state.other_mentors == 2,
                'end of one')
        for mentor in mentors:
            mentor.destroy_node()


def called(dashboard, call):
    """Await a call of a dashboard, which is updated meanwhile; return what it returned."""
    with ThreadPoolExecutor(1) as thread:
        future = thread.submit(asyncio.run, call)
        wait_until(lambda: (dashboard.update(), future.done())[1], 'response')
        return future.result()


def renamed(**names):
    """Return the ROS arguments of nodes with other names."""
    parameters = {'grid_world': ['-p', 'map:=bar_grid', '-p', 'rate:=50.0'],
                  'mentor': ['-p', 'mentor:=optimal'], 'learner': ['-p', 'iterations:=0']}
    return {node: [*parameters[node], '-r', f'__node:={name}'] for node, name in names.items()}


def test_nodes_of_other_names_are_shown_and_controlled(dashboard, tmp_path):
    with nodes(tmp_path, **renamed(grid_world='other_world', mentor='other_mentor',
                                   learner='other_learner')):
        state = updated(dashboard, lambda state: set(state.parameters['learner']) and set(
            state.parameters['grid_world']) and run_state_text(state) == 'running' and set(
                state.nodes) == {'other_world', 'other_mentor', 'other_learner'}, 'lesson')
        assert state.parameters['grid_world']['rate'].value == 50.0
        assert alarm_text(state) == ''
        called(dashboard, dashboard.set_remote_parameter('grid_world', 'rate', 20.0))
        called(dashboard, dashboard.set_remote_parameter('learner', 'discount', 0.5))
        called(dashboard, dashboard.set_paused(True))
        updated(dashboard, lambda state: run_state_text(state) == 'paused' and state.parameters[
            'grid_world']['rate'].value == 20.0 and state.parameters['learner'][
                'discount'].value == 0.5, 'pause and parameters')
        run = dashboard.page_state.run.reports.description.run
        called(dashboard, dashboard.step())
        called(dashboard, dashboard.reset())
        updated(dashboard, lambda state: state.run.reports.description.run != run, 'other run')


@pytest.mark.long
def test_a_world_of_another_name_takes_the_place_of_one_that_was_killed(dashboard, tmp_path):
    with nodes(tmp_path, **renamed(grid_world='first_world')) as running:
        updated(dashboard, lambda state: state.is_alive('first_world'), 'first world')
        running['grid_world'].kill()
        with nodes(tmp_path / 'second', **renamed(grid_world='second_world')):
            updated(dashboard, lambda state: state.is_alive('second_world')
                    and not state.is_alive('first_world'), 'second world')
            updated(dashboard, lambda state: 'world has sent no status' not in alarm_text(state),
                    'no alarm')
            called(dashboard, dashboard.set_paused(True))


def test_the_page_says_which_topic_has_no_publisher(dashboard):
    state = updated(dashboard, lambda state: alarm_text(state).count('.') == 3, 'alarm')
    assert alarm_text(state) == (
        'No world publishes on /world: start one with scripts/run grid_world. '
        'No mentor publishes on /recommendation: start one with scripts/run mentor. '
        'No learner publishes on /action: start one with scripts/run learner.')
    assert health_text(state, 'grid_world') == ('no world publishes on /world', '')
    for call in (dashboard.set_paused(True), dashboard.step(),
                 dashboard.set_remote_parameter('grid_world', 'rate', 1.0)):
        with pytest.raises(ServiceCallError, match='^no world publishes on /world$'):
            called(dashboard, call)


@pytest.mark.long
def test_a_learner_of_others_that_sends_no_status_is_not_missed(dashboard):
    with ros_client() as client:
        node = rclpy.create_node('turtle', namespace='sea', context=client.context)
        node.create_publisher(ACTION.message, f'/{ACTION.name}', ACTION.qos)
        state = updated(dashboard, lambda state: 'No world' in alarm_text(state)
                        and state.roles['learner'].is_publishing, 'alarm')
        assert 'learner' not in alarm_text(state)
        assert health_text(state, '/sea/turtle') == (
            'publishes on /action, and has sent no status', '')
        with pytest.raises(ServiceCallError, match='/sea/turtle'):
            called(dashboard, dashboard.set_remote_parameter('learner', 'discount', 0.5))
        node.destroy_node()
