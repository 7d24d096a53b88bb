# SPDX-License-Identifier: Apache-2.0
"""The executable `dashboard`: ROS in the main thread, the page in one, the mentor in another."""

from collections.abc import Generator, Sequence
from contextlib import contextmanager, ExitStack
from functools import partial
from importlib.util import find_spec
import socket
import sys
from threading import Thread
import time

import rclpy

from comply_ros.dashboard.access_control import AccessControl
from comply_ros.dashboard.access_token import page_token, print_token
from comply_ros.dashboard.dashboard_node import DashboardNode
from comply_ros.dashboard.mentor_ownership import MentorSeat
from comply_ros.dashboard.request_limits import MAX_MESSAGE, RequestLimits
from comply_ros.mentor.mentor_spec import MentorError
from comply_ros.mentor.policy_text import PolicyError
from comply_ros.nodes.node_processes import NodeProcess
from comply_ros.nodes.parameters import ParameterError
from comply_ros.nodes.spin import run_node
from comply_ros.storage.checkpoint_store import StateError
from comply_ros.terminal.interrupts import StopFlag
from comply_ros.world.planning import PlanningError

START_TIMEOUT = 30.0  # seconds that the server has to start
SWITCH_INTERVAL = 1e-4  # seconds that the page may keep the interpreter while the mentor waits
RECONNECT_TIMEOUT = 60.0  # seconds that a browser may be away, or slow, and keeps its page


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
        sys.setswitchinterval(SWITCH_INTERVAL)
        if find_spec('nicegui') is None:  # no ROS installation brings it
            raise ParameterError('the page needs the Python package nicegui, and it is not '
                                 'installed: requirements/python.txt names the version')
        token, is_new = page_token(node.address, node.token_file)
        listening = stack.enter_context(listen(node.address, node.port))
        seat = MentorSeat(node)
        stack.enter_context(seat.open())
        stack.enter_context(serving(node, seat, listening, token))
        if is_new:
            print_token(page_url(node.address, listening, token))
        # The address has a line of its own, which no terminal breaks in two.
        node.get_logger().info(f'ready:\n{page_url(node.address, listening)}')
        while rclpy.ok() and not stop.is_set():
            node.update()
            seat.update()


def listen(address: str, port: int) -> socket.socket:
    """Return a socket that listens there; raises ParameterError where that is impossible."""
    is_ipv6 = ':' in address
    try:
        return socket.create_server(
            (address, port), family=socket.AF_INET6 if is_ipv6 else socket.AF_INET,
            dualstack_ipv6=address == '::' and socket.has_dualstack_ipv6())
    except OSError as error:
        raise ParameterError(f'parameters address and port must be free to listen on, got '
                             f'{address!r} and {port} ({str(error.strerror).lower()})') from None


def page_url(address: str, listening: socket.socket, token: str = '') -> str:
    """URL of the page; with a token, it needs no other."""
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
    limits = RequestLimits(app)

    def page() -> None:
        limits.add_page(nicegui.ui.context.client)
        build_page(node, seat)
    nicegui.ui.page('/', title='comply_ros')(page)
    nicegui.ui.run_with(app, dark=None, show_welcome_message=False,
                        reconnect_timeout=RECONNECT_TIMEOUT)
    server = uvicorn.Server(uvicorn.Config(
        AccessControl(limits, token, node.get_logger().warning), log_level='warning',
        lifespan='on', timeout_graceful_shutdown=1, proxy_headers=False, ws_max_size=MAX_MESSAGE))
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
