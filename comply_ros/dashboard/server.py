# SPDX-License-Identifier: Apache-2.0
"""The executable `dashboard`: ROS in the main thread, the page in one, the mentor in another."""

from collections.abc import Generator, Sequence
from contextlib import contextmanager, ExitStack
from functools import partial
from importlib.util import find_spec
import re
import secrets
import socket
from threading import Thread
import time

import rclpy

from comply_ros.dashboard.access_control import AccessControl, LOCAL_HOSTS, MIN_TOKEN_LENGTH
from comply_ros.dashboard.dashboard_node import DashboardNode
from comply_ros.dashboard.mentor_seat import MentorSeat
from comply_ros.mentor.mentor_policies import MentorError
from comply_ros.mentor.policy_text import PolicyError
from comply_ros.nodes.node_processes import NodeProcess
from comply_ros.nodes.parameters import ParameterError
from comply_ros.nodes.spin import run_node
from comply_ros.storage.state_store import StateError
from comply_ros.terminal.interrupts import StopFlag
from comply_ros.world.planning import PlanningError

START_TIMEOUT = 30.0  # seconds that the server has to start
RECONNECT_TIMEOUT = 20.0  # seconds that a browser may be away, or slow, and keeps its page


def main(argv: list[str], processes: Sequence[NodeProcess] = ()) -> int:
    """
    Run the dashboard; return the exit code.

    processes: nodes that were started for it; the page tells if one ends.
    """
    return run_node(DashboardNode, argv, (ParameterError, MentorError, PolicyError, PlanningError,
                                          StateError),
                    spin=partial(spin_with_page, processes=processes))


def spin_with_page(node: DashboardNode, stop: StopFlag,
                   processes: Sequence[NodeProcess] = ()) -> None:
    """Serve the page and update its state until there is a Ctrl-C or an error."""
    with ExitStack() as stack:
        stack.callback(node.close)
        node.processes.extend(processes)
        if find_spec('nicegui') is None:  # no ROS installation brings it
            raise ParameterError('the page needs the Python package nicegui, and it is not '
                                 'installed: requirements/python.txt names the version')
        token = checked_token(node.address, node.token)
        listening = stack.enter_context(listen(node.address, node.port))
        seat = MentorSeat(node)
        stack.enter_context(seat.open())
        stack.enter_context(serving(node, seat, listening, token))
        node.get_logger().info(f'ready: {page_url(node.address, listening, token)}')
        while rclpy.ok() and not stop.is_set():
            node.update()
            seat.update()


def checked_token(address: str, token: str) -> str:
    """
    Return the token that the page asks for, '' for none; generated where one must be given.

    Raises ParameterError for a token that is easily guessed, or that no cookie can carry.
    """
    if not token:
        return '' if address in LOCAL_HOSTS else secrets.token_urlsafe(16)
    if not re.fullmatch(rf'[\w.-]{{{MIN_TOKEN_LENGTH},}}', token, re.ASCII):
        raise ParameterError(f'parameter token must have at least {MIN_TOKEN_LENGTH} letters, '
                             f'digits, _, . or -, got {token!r}')
    return token


def listen(address: str, port: int) -> socket.socket:
    """Return a socket that listens there; raises ParameterError where that is impossible."""
    family = socket.AF_INET6 if ':' in address else socket.AF_INET
    try:
        return socket.create_server((address, port), family=family)
    except OSError as error:
        raise ParameterError(f'parameters address and port must be free to listen on, got '
                             f'{address!r} and {port} ({str(error.strerror).lower()})') from None


def page_url(address: str, listening: socket.socket, token: str) -> str:
    """URL that opens the page in a browser, with the token."""
    host = socket.gethostname() if address in ('', '0.0.0.0', '::') else address
    host = f'[{host}]' if ':' in host else host
    return f'http://{host}:{listening.getsockname()[1]}/' + (f'?token={token}' if token else '')


@contextmanager
def serving(node: DashboardNode, seat: MentorSeat, listening: socket.socket,
            token: str) -> Generator[None]:
    """Serve the page in a thread while the block runs."""
    import fastapi
    import nicegui.ui
    import uvicorn

    from comply_ros.dashboard.page import build_page
    app = fastapi.FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
    nicegui.ui.page('/', title='comply_ros')(lambda: build_page(node, seat))
    nicegui.ui.run_with(app, dark=None, show_welcome_message=False,
                        reconnect_timeout=RECONNECT_TIMEOUT)
    server = uvicorn.Server(uvicorn.Config(AccessControl(app, token), log_level='warning',
                                           lifespan='on', timeout_graceful_shutdown=1))
    thread = Thread(target=server.run, args=([listening],), name='page', daemon=True)
    thread.start()
    end = time.monotonic() + START_TIMEOUT
    while not server.started and thread.is_alive() and time.monotonic() < end:
        time.sleep(0.01)
    try:
        yield
    finally:
        server.should_exit = True
        thread.join(5.0)
