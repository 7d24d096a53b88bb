# SPDX-License-Identifier: Apache-2.0
"""The rooms of the package: each imports only from those before it in `ROOMS`."""

import ast
from functools import cache
from pathlib import Path
import subprocess
import sys

import pytest

import comply_ros

PACKAGE = Path(comply_ros.__file__).parent
ROS = {'rclpy', 'comply_msgs', 'diagnostic_msgs', 'rcl_interfaces', 'launch', 'launch_ros',
       'geometry_msgs', 'nav_msgs', 'sensor_msgs', 'std_msgs', 'std_srvs', 'tf2_msgs',
       'visualization_msgs', 'builtin_interfaces', 'rosgraph_msgs', 'ament_index_python'}
# Lowest first; what each may import besides the standard library and the rooms before it.
ROOMS = {
    'numerics': {'numpy', 'numba'},
    'world': {'numpy'},
    'mentor': {'numpy'},
    'learner': {'numpy'},
    'protocol': {'numpy'},
    'storage': {'numpy', 'ruamel', 'PIL', 'gymnasium'},
    'plots': {'numpy', 'matplotlib'},
    'terminal': {'numpy', 'prompt_toolkit', 'rich'},
    'bags': {'numpy', 'ruamel', 'pydantic', 'rosbags', 'mcap', 'zstandard', 'lz4'},
    'experiments': {'numpy', 'pydantic', 'pydantic_core', 'matplotlib', 'distributed',
                    'gymnasium'},
    'nodes': {'numpy', 'yaml', *ROS},
    'dashboard': {'numpy', 'PIL', 'nicegui', 'fastapi', 'uvicorn', *ROS},
}
PURE = ('numerics', 'world', 'mentor', 'learner', 'protocol')
# Modules of the standard library that reach beyond the process: a pure room has none of them.
IMPURE = {'os', 'pathlib', 'time', 'datetime', 'subprocess', 'socket', 'shutil', 'tempfile',
          'threading', 'multiprocessing', 'random', 'secrets', 'io', 'sys'}


@cache
def imports(path):
    """Return the modules that a file imports, anywhere in it."""
    return list(imports_of(path))


def imports_of(path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module == 'comply_ros':
            yield from (f'comply_ros.{alias.name}' for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.module or ''


@pytest.mark.parametrize('room', ROOMS)
def test_a_room_imports_only_from_the_rooms_before_it(room):
    names = list(ROOMS)
    allowed = {f'comply_ros.{name}' for name in names[:names.index(room) + 1]} | ROOMS[room]
    allowed |= {'comply_ros.__version__'}
    files = list((PACKAGE / room).glob('*.py'))
    assert files
    for path in files:
        for module in imports(path):
            parts = module.split('.')
            name = '.'.join(parts[:2]) if parts[0] == 'comply_ros' else parts[0]
            assert name in allowed or name in sys.stdlib_module_names, (path.name, module)
            assert room not in PURE or name not in IMPURE, (path.name, module)


def test_only_one_file_knows_numba():
    knowing = [path.name for path in PACKAGE.rglob('*.py') if 'numba' in set(imports(path))]
    assert knowing == ['jit.py']


def test_training_works_where_there_is_no_ros():
    code = ('import sys; sys.modules.update(dict.fromkeys(["rclpy", "comply_msgs"]));'
            'import comply_ros.experiments.train')
    assert subprocess.run([sys.executable, '-c', code], check=False).returncode == 0


def test_only_the_dashboard_knows_the_page():
    knowing = {path.parent.name for path in PACKAGE.rglob('*.py')
               if {'nicegui', 'fastapi', 'uvicorn'} & set(imports(path))}
    assert knowing == {'dashboard'}


def test_a_node_does_not_import_the_compiler_or_the_drawing():
    code = ('import sys; import comply_ros.nodes.learner, comply_ros.nodes.mentor,'
            ' comply_ros.nodes.grid_world;'
            'sys.exit(bool({"numba", "matplotlib"} & set(sys.modules)))')
    done = subprocess.run([sys.executable, '-c', code], check=False, capture_output=True,
                          text=True)
    assert done.returncode == 0, done.stderr
