# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C ends a training at any moment, in one line."""

import os
from pathlib import Path
import signal
import subprocess
import sys
import time

import pytest
from waiting import DEADLINE


@pytest.mark.parametrize('moment', [0.3, 0.8, 2.0])
def test_ctrl_c_ends_a_training(tmp_path, moment):
    process = subprocess.Popen(
        [sys.executable, '-c', 'import sys; from comply_ros.executables import train;'
         'sys.exit(train())', '--iterations', '1000000', '--mentor', 'none', '--out',
         str(tmp_path)], stderr=subprocess.PIPE, text=True)
    deadline = time.monotonic() + DEADLINE
    while time.monotonic() < deadline and processor_seconds(process.pid) < moment:
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    try:
        error = process.communicate(timeout=DEADLINE)[1]
    finally:
        process.kill()
    assert process.returncode == 130
    assert 'Traceback' not in error
    assert error.endswith('train: interrupted\n') or moment < 1.0  # before it started


def processor_seconds(pid):
    """Return the processor time that a process has used."""
    numbers = Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()
    return (int(numbers[11]) + int(numbers[12])) / os.sysconf('SC_CLK_TCK')
