# SPDX-License-Identifier: Apache-2.0
"""The nodes of `examples/` as processes, for tests."""

from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
import subprocess
import sys

EXAMPLES = Path(__file__).parents[2] / 'examples'


@contextmanager
def example(name: str) -> Generator[None]:
    """Run a node of the examples; it must end without a traceback."""
    process = subprocess.Popen([sys.executable, str(EXAMPLES / f'{name}.py')])
    try:
        yield
    finally:
        process.terminate()
        code = process.wait()
    assert code == 0
