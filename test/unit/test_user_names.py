# SPDX-License-Identifier: Apache-2.0
"""Names that a user chose are printed and drawn as they are: in no language are they parsed."""

import os
from pathlib import Path
import subprocess
import sys

from node_processes import run
import pytest

from comply_ros import train
import comply_ros.maps
