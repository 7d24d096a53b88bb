# SPDX-License-Identifier: Apache-2.0
"""What is imported is declared, in `setup.py` and in `package.xml`, and nothing else is."""

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path
import re
import subprocess
import sys
from unittest import mock
import xml.etree.ElementTree as ElementTree

import pytest
import setuptools

from comply_ros.executables import EXTRAS, ROS_PACKAGES

TOP = Path(__file__).parents[2]
# How packages are named where their name is not that of the import.
DISTRIBUTIONS = {'yaml': 'PyYAML', 'ruamel': 'ruamel.yaml', 'mcap_ros2': 'mcap-ros2-support',
                 'pydantic_core': 'pydantic', 'PIL': 'Pillow'}
# Keys of rosdep (rosdep/base.yaml, python.yaml) that give a package of the system, not of pip.
ROSDEP_KEYS = {
    'fastapi': 'python3-fastapi', 'hypothesis': 'python3-hypothesis',
    'matplotlib': 'python3-matplotlib', 'numba': 'python3-numba', 'numpy': 'python3-numpy',
    'pydantic': 'python3-pydantic', 'pydantic_core': 'python3-pydantic',
    'PIL': 'python3-pil', 'prompt_toolkit': 'python3-prompt-toolkit',
    'pytest': 'python3-pytest', 'rich': 'python3-rich', 'ruamel': 'python3-ruamel.yaml',
    'uvicorn': 'python3-uvicorn', 'yaml': 'python3-yaml'}
WITHOUT_KEY = {'distributed', 'gymnasium', 'lz4', 'mcap', 'mcap_ros2', 'nicegui', 'playwright',
               'rosbags', 'zstandard'}
LINTERS = {'ament_flake8', 'ament_pep257', 'ament_xmllint'}
TEST_ROS_PACKAGES = {'domain_coordinator', 'rosgraph_msgs', 'rosidl_parser', *LINTERS}
OWN = {'comply_ros', 'examples', 'tools', 'setuptools'}
STANDARD = {*sys.stdlib_module_names, 'compression'}  # the last one since Python 3.14
COMPARED = {'mushroom_rl', 'stable_baselines3'}  # by tests and tools, if installed
LOADERS = {'import_module', 'importorskip'}


def imported_names(*folders: str) -> set[str]:
    """Top-level names of what the files of these folders import, without their own."""
    own = {path.stem for path in (TOP / 'test').rglob('*.py')} | OWN | STANDARD
    return {name for folder in folders for name in names_in_folder(folder)} - own


@cache
def names_in_folder(folder: str) -> set[str]:
    return {name.split('.')[0] for path in (TOP / folder).rglob('*.py')
            for name in names_in(ast.parse(path.read_text(encoding='utf-8')))}


def names_in(tree: ast.Module) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            yield node.module
        elif (isinstance(node, ast.Call) and node.args and isinstance(node.args[0], ast.Constant)
              and getattr(node.func, 'attr', getattr(node.func, 'id', '')) in LOADERS):
            yield node.args[0].value


@pytest.fixture
def setup_arguments(monkeypatch):
    """Return what `setup.py` gives to setuptools."""
    monkeypatch.chdir(TOP)
    with mock.patch.object(setuptools, 'setup') as setup:
        exec(compile((TOP / 'setup.py').read_text(), 'setup.py', 'exec'), {'__name__': 'setup'})
    return setup.call_args.kwargs


def requirements(lines: list[str]) -> set[str]:
    return {re.match(r'[\w.-]+', line)[0] for line in lines}


def declared(*tags: str) -> set[str]:
    package = ElementTree.parse(TOP / 'package.xml').getroot()
    return {each.text for tag in tags for each in package.findall(tag)}


def distributions(names: set[str]) -> set[str]:
    return {DISTRIBUTIONS.get(name, name) for name in names}


def python_packages(names: set[str]) -> set[str]:
    return names - {*ROS_PACKAGES, *TEST_ROS_PACKAGES, 'comply_msgs', 'launch', 'launch_ros'}


def test_setup_py_requires_what_the_package_imports(setup_arguments):
    extras = {name for packages in EXTRAS.values() for name in packages}
    imported = python_packages(imported_names('comply_ros', 'launch'))
    assert extras <= imported
    assert (requirements(setup_arguments['install_requires']) - {'setuptools'}
            == distributions(imported - extras))
    for extra, packages in EXTRAS.items():
        assert requirements(setup_arguments['extras_require'][extra]) == distributions(
            set(packages))


def test_the_extra_for_tests_has_what_only_tests_import(setup_arguments):
    package = imported_names('comply_ros', 'launch')
    only_tests = python_packages(imported_names('test') - package) - COMPARED
    assert requirements(setup_arguments['extras_require']['test']) == distributions(only_tests)


def test_package_xml_depends_on_what_the_package_imports_and_rosdep_knows():
    imported = imported_names('comply_ros', 'launch') | {'builtin_interfaces'}  # record names it
    keys = {ROSDEP_KEYS.get(name, name) for name in imported - WITHOUT_KEY}
    assert declared('depend', 'exec_depend') == keys


def test_package_xml_depends_for_tests_on_what_only_tests_import():
    imported = imported_names('test', 'tools') - imported_names('comply_ros', 'launch')
    keys = {ROSDEP_KEYS.get(name, name) for name in imported - WITHOUT_KEY}
    keys -= COMPARED
    assert declared('test_depend') == keys


def test_the_lists_of_requirements_pin_what_the_package_requires(setup_arguments):
    lists = ''.join((TOP / 'requirements' / f'{name}.txt').read_text()
                    for name in ('python', 'ros'))
    pinned = {name.lower() for name in re.findall(r'(?m)^([\w.-]+)\S*==', lists)}
    needed = requirements(setup_arguments['install_requires'])
    for packages in EXTRAS.values():
        needed |= requirements(list(packages.values()))
    assert {name.lower() for name in needed} <= pinned


@pytest.mark.parametrize('package', ['pytest', 'ruff', 'ty', 'coverage', 'mkdocs',
                                     'ros-domain-coordinator'])
def test_the_set_up_of_a_user_has_no_tools_of_developers(package):
    for name in ('python', 'ros'):
        assert not re.search(rf'(?m)^{package}\b',
                             (TOP / 'requirements' / f'{name}.txt').read_text())


@pytest.mark.parametrize('executable, missing, sentence', [
    ('plot', 'rosbags', "plot: needs the Python package rosbags (extra 'bags' of comply_ros), "
     'which is not installed: python3 -m pip install rosbags mcap lz4 zstandard\n'),
    ('train', 'rich', 'train: needs the Python package rich, which is not installed: in a '
     'workspace, rosdep install --from-paths src; without ROS, python3 -m pip install '
     'FOLDER_OF_COMPLY_ROS\n'),
    ('grid_world', 'rclpy', 'grid_world: needs the ROS package rclpy, which is not installed, '
     'or not sourced: . /opt/ros/$ROS_DISTRO/setup.bash\n')])
def test_a_missing_package_is_one_sentence_with_the_remedy(executable, missing, sentence):
    program = f"""
import sys
class Missing:
    def find_spec(self, name, path=None, target=None):
        if name.split('.')[0] == {missing!r}:
            raise ModuleNotFoundError(f'No module named {{name!r}}', name=name)
sys.meta_path.insert(0, Missing())
from comply_ros.executables import {executable}
sys.argv = [{executable!r}, '--help']
sys.exit({executable}())
"""
    done = subprocess.run([sys.executable, '-c', program], capture_output=True, text=True,
                          check=False, cwd=TOP)
    assert (done.returncode, done.stdout, done.stderr) == (2, '', sentence)
