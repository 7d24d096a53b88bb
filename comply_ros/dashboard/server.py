# SPDX-License-Identifier: Apache-2.0
"""The executable `dashboard`: ROS in the main thread, the page in one, the mentor in another."""

from contextlib import contextmanager, ExitStack
from importlib.util import find_spec
import re
import secrets
import socket
from threading import Thread
import time

import rclpy

from comply_ros.dashboard.access_control import AccessControl, HOME, SHORTEST_TOKEN
from comply_ros.dashboard.dashboard_node import DashboardNode
from comply_ros.mentor.mentor_policies import MentorError
from comply_ros.mentor.policy_text import PolicyError
from comply_ros.nodes.parameters import ParameterError
from comply_ros.nodes.spin import run_node
from comply_ros.storage.state_store import StateError
from comply_ros.world.planning import PlanningError

START = 30.0  # seconds that the server has to start
RECONNECT = 20.0  # seconds that a browser may be away, or slow, before its page is made anew


def main(argv):
    """Run the dashboard; return the exit code."""
    return run_node(DashboardNode, argv, (ParameterError, MentorError, PolicyError, PlanningError,
                                    StateError), spin=spin_with_page)


def spin_with_page(watcher, stop):
    """Serve the page, and look at the lesson, until there is a Ctrl-C or a mistake."""
    with ExitStack() as ends:
        ends.callback(watcher.leave)
        check_library()
        token = checked_token(watcher.address, watcher.token)
        listening = ends.enter_context(listen(watcher.address, watcher.port))
        teacher = ends.enter_context(teaching()) if watcher.teach else None
        ends.enter_context(served(watcher, teacher, listening, token))
        watcher.get_logger().info(f'ready: {link(watcher.address, listening, token)}')
        while rclpy.ok() and not stop.is_set():
            watcher.look()
            if teacher and teacher.mistake:
                raise teacher.mistake


def check_library():
    """
    Return if the library of the page is there.

    Raises
    ------
    ParameterError: with what to install, if it is not: no ROS installation brings it.

    """
    if find_spec('nicegui') is None:
        raise ParameterError('the page needs the Python package nicegui, and it is not installed: '
                             'requirements/python.txt names the version')


@contextmanager
def teaching():
    """Give a `MentorThread` that runs while the block does."""
    from comply_ros.dashboard.mentor_thread import MentorThread
    from comply_ros.nodes.human_mentor import HumanMentorNode
    teacher = MentorThread(HumanMentorNode())
    with teacher.running():
        yield teacher


def checked_token(address, token):
    """
    Return the token that a page is asked for, '' for none: made where one is needed and not given.

    Raises
    ------
    ParameterError: for one that is easily guessed, or that no cookie can carry.

    """
    if not token:
        return '' if address in HOME else secrets.token_urlsafe(16)
    if not re.fullmatch(rf'[\w.-]{{{SHORTEST_TOKEN},}}', token, re.ASCII):
        raise ParameterError(f'parameter token must have at least {SHORTEST_TOKEN} letters, '
                             f'digits, _, . or -, got {token!r}')
    return token


def listen(address, port):
    """
    Return a socket that listens on an address and port.

    Raises
    ------
    ParameterError: if it cannot: another program has the port, or there is no such address.

    """
    family = socket.AF_INET6 if ':' in address else socket.AF_INET
    try:
        return socket.create_server((address, port), family=family)
    except OSError as error:
        raise ParameterError(f'parameters address and port must be free to listen on, got '
                             f'{address!r} and {port} ({str(error.strerror).lower()})') from None


def link(address, listening, token):
    """Address of the page to open in a browser, the token in it."""
    host = socket.gethostname() if address in ('', '0.0.0.0', '::') else address
    host = f'[{host}]' if ':' in host else host
    return f'http://{host}:{listening.getsockname()[1]}/' + (f'?token={token}' if token else '')


@contextmanager
def served(watcher, teacher, listening, token):
    """Serve the page in a thread while the block runs."""
    import fastapi
    import nicegui.ui
    import uvicorn

    from comply_ros.dashboard.page import show
    app = fastapi.FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
    nicegui.ui.page('/', title='comply_ros')(lambda: show(watcher, teacher))
    nicegui.ui.run_with(app, dark=None, show_welcome_message=False, reconnect_timeout=RECONNECT)
    server = uvicorn.Server(uvicorn.Config(
        AccessControl(app, token), log_level='warning', lifespan='on', timeout_graceful_shutdown=1))
    thread = Thread(target=server.run, args=([listening],), name='page', daemon=True)
    thread.start()
    end = time.monotonic() + START
    while not server.started and thread.is_alive() and time.monotonic() < end:
        time.sleep(0.01)
    try:
        yield
    finally:
        server.should_exit = True
        thread.join(5.0)
