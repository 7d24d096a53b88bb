# SPDX-License-Identifier: Apache-2.0
"""The house: dashboard -> nodes -> bags -> session -> core <- experiments; no arrow back."""

import ast
from pathlib import Path
import subprocess
import sys

import pytest

import comply_ros

HOUSE = Path(comply_ros.__file__).parent
ROS = {'rclpy', 'comply_msgs', 'diagnostic_msgs', 'rcl_interfaces', 'rosidl_parser', 'launch',
       'launch_ros', 'geometry_msgs', 'nav_msgs', 'std_msgs', 'std_srvs',
       'visualization_msgs', 'ament_index_python'}
MAY_IMPORT = {
    'core': {'comply_ros.core', 'numpy', 'numba'},
    'session': {'comply_ros.__version__', 'comply_ros.core', 'comply_ros.session', 'numpy',
                'matplotlib', 'rich', 'yaml'},
    'experiments': {'comply_ros.core', 'comply_ros.session', 'comply_ros.experiments', 'numpy',
                    'yaml', 'distributed', 'matplotlib'},
    'bags': {'comply_ros.core', 'comply_ros.session', 'comply_ros.bags', 'numpy', 'yaml',
             'rosbags', 'lz4', 'backports', 'compression'},
    'nodes': {'comply_ros.core', 'comply_ros.session', 'comply_ros.nodes', 'comply_ros.bags',
              'numpy', 'yaml', 'ament_index_python'} | ROS,
    'dashboard': {'comply_ros.core', 'comply_ros.session', 'comply_ros.nodes',
                  'comply_ros.dashboard', 'numpy', 'nicegui', 'fastapi', 'uvicorn', 'std_srvs'}
    | ROS,
    'benchmarks': {'comply_ros', 'comply_ros.__version__', 'comply_ros.core',
                   'comply_ros.session', 'comply_ros.nodes', 'comply_ros.benchmarks', 'numpy',
                   'yaml', 'rich', 'gymnasium', 'mushroom_rl'}
    | ROS,
}


def imports(path):
    """Return the modules that a file imports, anywhere in it."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module == 'comply_ros':
            yield from (f'comply_ros.{alias.name}' for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.module


@pytest.mark.parametrize('room', MAY_IMPORT)
def test_a_room_imports_only_what_its_promise_allows(room):
    files = list((HOUSE / room).glob('*.py'))
    assert files
    for path in files:
        for module in imports(path):
            parts = module.split('.')
            name = '.'.join(parts[:2]) if parts[0] == 'comply_ros' else parts[0]
            assert name in MAY_IMPORT[room] or name in sys.stdlib_module_names, (path, module)


def test_only_one_file_knows_numba():
    knowing = [path.name for path in HOUSE.rglob('*.py') if 'numba' in set(imports(path))]
    assert knowing == ['compiled.py']


def test_core_and_session_work_where_there_is_no_ros():
    code = ('import sys; sys.modules.update(dict.fromkeys(["rclpy", "comply_msgs"]));'
            'import comply_ros.experiments.train')
    assert subprocess.run([sys.executable, '-c', code], check=False).returncode == 0


def test_only_the_dashboard_knows_the_page():
    knowing = {path.parent.name for path in HOUSE.rglob('*.py')
               if {'nicegui', 'fastapi', 'uvicorn'} & set(imports(path))}
    assert knowing == {'dashboard'}


def test_a_node_does_not_import_the_compiler_or_the_drawing():
    code = ('import sys; import comply_ros.nodes.learner, comply_ros.nodes.mentor,'
            ' comply_ros.nodes.grid_world;'
            'sys.exit(bool({"numba", "matplotlib"} & set(sys.modules)))')
    done = subprocess.run([sys.executable, '-c', code], check=False, capture_output=True,
                          text=True)
    assert done.returncode == 0, done.stderr
