# SPDX-License-Identifier: Apache-2.0
"""The SROS2 policies: each grants exactly what its running node uses."""

from pathlib import Path
import subprocess
import sys
import time
import xml.etree.ElementTree as ElementTree

from ament_index_python import get_package_share_directory
from node_processes import log_has, nodes
from pty_session import pty_session
import pytest
import rclpy
from rclpy.node import Node
from waiting import DEADLINE, wait_until

from comply_ros.nodes import topics
from comply_ros.nodes.node_processes import START

FOLDER = Path(__file__).parents[2] / 'config' / 'security'
NODES = ('grid_world', 'mentor', 'learner', 'lesson', 'viewer')
OTHERS = {'teleop_mentor': 'mentor'}  # executables that replace a node, and its name
# A mentor that advises after mistakes subscribes to actions too; slow, to save processor time.
LESSON = ('--map', 'bar_grid', '--mentor', 'optimal', '--iterations', '100000', '--rate', '5',
          '--budget', '20', '--advising', 'mistakes')
NAMES_BY_VERB = {
    'publish': Node.get_publisher_names_and_types_by_node,
    'subscribe': Node.get_subscriber_names_and_types_by_node,
    'reply': Node.get_service_names_and_types_by_node,
    'request': Node.get_client_names_and_types_by_node}
PUBLISHES_ON = {
    'grid_world': (topics.WORLD, topics.STATE, topics.EPISODE),
    'mentor': (topics.RECOMMENDATION, topics.MENTOR_POLICY),
    'learner': (topics.DESCRIPTION, topics.ACTION, topics.PROGRESS, topics.TRUST, topics.POLICY,
                topics.VALUES)}


def policy(name):
    """Return the root element of the policy file of a node."""
    return ElementTree.parse(FOLDER / f'{name}.policy.xml').getroot()


def granted(name, namespace='/'):
    """Return the set of (verb, full name) that a policy allows in a namespace."""
    profile, = policy(name).iterfind('enclaves/enclave/profiles/profile')
    return {(verb, full_name(each.text, namespace, profile.get('node')))
            for rule in profile for verb in rule.keys() for each in rule}


def full_name(name, namespace, node):
    """Return a name of a profile as sros2 resolves it."""
    if name.startswith('/'):
        return name
    start = namespace.rstrip('/') + '/'
    return start + (f'{node}{name[1:]}' if name.startswith('~') else name)


def used(node, name, namespace):
    """Return the set of (verb, full name) that a node has in the graph."""
    if (name, namespace) not in node.get_node_names_and_namespaces():
        return set()
    return {(verb, each) for verb, names in NAMES_BY_VERB.items()
            for each, _ in names(node, name, namespace)}


def differences(node, namespace, names=NODES):
    """Return what is granted and not used, and what is used and not granted, by node."""
    found = {}
    for name in names:
        allowed = granted(name, namespace)
        seen = used(node, OTHERS.get(name, name), namespace)
        if allowed != seen:
            found[name] = {'not used': allowed - seen, 'not granted': seen - allowed}
    return found


@pytest.fixture(params=['/', pytest.param('/second', marks=pytest.mark.long)])
def namespace(request, domain, tmp_path):
    """Run the five nodes in a namespace, and return the namespace."""
    lesson = subprocess.Popen(
        [sys.executable, '-c', START.format('lesson'), *LESSON, '--out', str(tmp_path),
         '--namespace', request.param.strip('/')], stderr=subprocess.DEVNULL)
    log = tmp_path / 'learner.log'
    try:
        wait_until(lambda: log.exists() and 'starts to learn' in log.read_text(), 'learning')
        with nodes(tmp_path / 'viewer', viewer=('-r', f'__ns:={request.param}')):
            yield request.param
    finally:
        lesson.terminate()
        lesson.wait(DEADLINE)


@pytest.fixture
def node(namespace):
    """Return a node of the test, made after the others."""
    context = rclpy.Context()
    rclpy.init(context=context)
    yield Node('test', context=context)
    rclpy.try_shutdown(context=context)


def test_a_policy_grants_exactly_what_its_running_node_uses(node, namespace):
    end = time.monotonic() + DEADLINE / 2
    while (found := differences(node, namespace)) and time.monotonic() < end:
        time.sleep(0.01)
    assert found == {}


@pytest.mark.usefixtures('domain')
@pytest.mark.long
def test_a_policy_grants_exactly_what_teleop_mentor_uses():
    context = rclpy.Context()
    rclpy.init(context=context)
    node = Node('test', context=context)
    with pty_session():
        end = time.monotonic() + DEADLINE / 2
        while (found := differences(node, '/', OTHERS)) and time.monotonic() < end:
            time.sleep(0.01)
    rclpy.try_shutdown(context=context)
    assert found == {}


@pytest.mark.parametrize('name, topic', [
    (name, topic.name) for name, published in PUBLISHES_ON.items() for topic in published])
def test_only_one_node_may_publish_on_a_topic(name, topic):
    assert [each for each in NODES if ('publish', f'/{topic}') in granted(each)] == [name]


def test_every_topic_has_a_node_that_publishes_on_it():
    assert sorted(topic.name for each in PUBLISHES_ON.values() for topic in each) == sorted(
        each.name for each in vars(topics).values() if isinstance(each, topics.Topic))


@pytest.mark.parametrize('name', [*NODES, *OTHERS])
def test_a_policy_is_one_enclave_with_one_node_and_no_wildcard(name):
    root = policy(name)
    enclave, = root.iterfind('enclaves/enclave')
    profile, = enclave.iterfind('profiles/profile')
    assert root.get('version') == '0.2.0'
    assert enclave.get('path') == f'/{name}'
    assert (profile.get('ns'), profile.get('node')) == ('/', OTHERS.get(name, name))
    assert {value for rule in profile for value in rule.attrib.values()} == {'ALLOW'}
    assert not any('*' in full for _, full in granted(name))


@pytest.fixture
def page(domain, tmp_path):
    """Run a dashboard with its mentor."""
    with nodes(tmp_path, dashboard=['-p', 'port:=0']) as running:
        wait_until(log_has(running['dashboard'], 'ready:'), 'page')
        yield


@pytest.mark.long
def test_the_policy_of_the_dashboard_grants_exactly_what_its_two_nodes_use(page):
    context = rclpy.Context()
    rclpy.init(context=context)
    node = Node('test', context=context)
    try:
        for profile in policy('dashboard').iterfind('enclaves/enclave/profiles/profile'):
            name = profile.get('node')
            allowed = {(verb, full_name(each.text, '/', name))
                       for rule in profile for verb in rule.keys() for each in rule}
            wait_until(lambda: allowed <= used(node, name, '/'), f'full use by {name}')
            assert used(node, name, '/') == allowed
    finally:
        rclpy.try_shutdown(context=context)


def test_the_policies_are_installed():
    folder = Path(get_package_share_directory('comply_ros')) / 'config' / 'security'
    assert {path.name for path in folder.iterdir()} == {
        f'{name}.policy.xml' for name in (*NODES, *OTHERS, 'dashboard')}
    for path in folder.iterdir():
        assert path.read_bytes() == (FOLDER / path.name).read_bytes()
