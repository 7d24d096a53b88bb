# SPDX-License-Identifier: Apache-2.0
"""What it was measured on; nothing that tells whose machine it was."""

from datetime import date
from importlib.metadata import PackageNotFoundError, version
import os
from pathlib import Path
import platform

from comply_ros import __version__

PACKAGES = {'numpy': 'numpy', 'numba': 'numba', 'rclpy': 'ros-rclpy', 'gymnasium': 'gymnasium',
            'mushroom_rl': 'mushroom-rl'}


def machine():
    """Table of the processor, its cores, the versions, and the date."""
    return {'date': date.today().isoformat(), 'processor': processor(), 'cores': os.cpu_count(),
            'load at the start': round(os.getloadavg()[0], 1),
            'comply_ros': __version__, 'Python': platform.python_version(),
            **{name: installed(package, name) for name, package in PACKAGES.items()}}


def processor():
    """Name of the processor's model."""
    for line in Path('/proc/cpuinfo').read_text().splitlines():
        if line.startswith('model name'):
            return line.partition(':')[2].strip()
    return platform.machine()


def installed(*names):
    """Version of a package by the first of its names that is installed, None if none is."""
    for name in names:
        try:
            return version(name)
        except PackageNotFoundError:
            continue
    return None
