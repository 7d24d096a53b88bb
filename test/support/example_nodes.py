# SPDX-License-Identifier: Apache-2.0
"""The nodes of `examples/` and of the pages as processes, for tests."""

from collections.abc import Generator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
import signal
import subprocess
import sys

from waiting import DEADLINE

EXAMPLES = Path(__file__).parents[2] / 'examples'


@contextmanager
def example(name: str) -> Generator[None]:
    """Run a node of the examples; it must end without a traceback."""
    with script(EXAMPLES / f'{name}.py') as process:
        yield
    assert process.returncode == 0


@contextmanager
def script(path: Path) -> Generator[subprocess.Popen]:
    """
    Run a file that spins a node with rclpy; end it as Ctrl-C in its terminal does.

    Not with SIGTERM: rclpy first wakes the executor and then shuts the context down, so that the
    executor may be asleep again by then, for ever. After SIGINT Python raises KeyboardInterrupt.
    """
    process = subprocess.Popen(  # a shell without a terminal starts its jobs with SIGINT ignored
        [sys.executable, str(path)],
        preexec_fn=partial(signal.signal, signal.SIGINT, signal.SIG_DFL))
    try:
        yield process
        process.send_signal(signal.SIGINT)
        process.wait(DEADLINE)
    finally:
        process.kill()
        process.wait()
