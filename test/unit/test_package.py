# SPDX-License-Identifier: Apache-2.0
"""The package: executables, launch file, parameter file, versions, licences."""

import ast
from pathlib import Path
import re
import xml.etree.ElementTree as ElementTree

import pytest
import yaml

import comply_ros
from comply_ros import executables
from comply_ros.executables import EXECUTABLES
from comply_ros.learner.learner_config import CONFIG_FIELDS

TOP = Path(__file__).parents[2]
KNOWN = {'grid_world': {'map', 'profile', 'seed', 'rate', 'state_dir'},
         'mentor': {'mentor', 'seed', 'budget', 'advising', 'robots', 'state_dir'},
         'learner': {'method', 'profile', 'seed', 'map_period', 'remembers_advice',
                     'advice_timeout', 'initial_learning', 'state_dir', 'end_when_finished',
                     *CONFIG_FIELDS}}


@pytest.mark.parametrize('name', EXECUTABLES)
def test_an_executable_has_an_entry_point_and_a_module(name):
    assert callable(getattr(executables, name))
    module, _ = EXECUTABLES[name]
    assert (TOP / 'comply_ros' / f'{module.replace(".", "/")}.py').is_file()


def test_the_parameter_file_names_parameters_that_exist():
    text = (TOP / 'config' / 'teach.yaml').read_text()
    offered = re.sub(r'(?m)^    # (\w+: \S+)', r'    \1', text)
    for content in (yaml.safe_load(text), yaml.safe_load(offered)):
        assert set(content) == {f'/**/{name}' for name in KNOWN}
        for name, table in content.items():
            assert set(table['ros__parameters']) <= KNOWN[name.removeprefix('/**/')]


def test_the_launch_file_has_the_documented_arguments_and_all_methods():
    tables = {node.targets[0].id: node.value for node in ast.parse(
        (TOP / 'launch' / 'teach.launch.py').read_text()).body if isinstance(node, ast.Assign)}
    names = [row.elts[0].value for row in tables['ARGUMENTS'].elts]
    assert names == ['map', 'method', 'mentor', 'mentors', 'mentor_seed', 'budget',
                     'advice_timeout', 'rate', 'seed', 'iterations', 'initial_learning',
                     'learns', 'profile', 'namespace', 'robots', 'params_file', 'state_dir',
                     'respawn', 'end_when_finished', 'viewer', 'rviz', 'dashboard', 'teach',
                     'record', 'log_level']
    choices, renamed = (ast.literal_eval(tables[name]) for name in ('CHOICES', 'RENAMED'))
    assert set(choices) < set(names) and '' not in sum(choices.values(), [])
    for node, arguments in ast.literal_eval(tables['NODES']).items():
        assert {renamed.get(each, each) for each in arguments} <= KNOWN[node]


def test_versions_agree():
    versions = {ElementTree.parse(TOP / path).findtext('version')
                for path in ('package.xml', 'msg_defs/package.xml')}
    versions.add(comply_ros.__version__)
    versions |= set(re.findall(r"version='([\d.]+)'", (TOP / 'setup.py').read_text()))
    for path in ('CHANGELOG.rst', 'msg_defs/CHANGELOG.rst'):
        text = (TOP / path).read_text()
        versions |= {re.search(r'(?m)^(\d[\d.]+) \(\d{4}-\d\d-\d\d\)$', text)[1]}
    assert len(versions) == 1


@pytest.mark.parametrize('path', ['package.xml', 'msg_defs/package.xml'])
def test_package_xml_is_format_3_and_has_its_urls(path):
    package = ElementTree.parse(TOP / path).getroot()
    assert package.get('format') == '3'
    assert {each.get('type') for each in package.findall('url')} == {'website', 'repository',
                                                                      'bugtracker'}


@pytest.mark.parametrize('path', sorted(
    path for folder in ('comply_ros', 'tools', 'examples', 'launch', 'test')
    for path in (TOP / folder).rglob('*.py')), ids=lambda path: str(path.relative_to(TOP)))
def test_every_source_file_names_its_licence(path):
    assert path.read_text().startswith('# SPDX-License-Identifier: Apache-2.0\n')


def test_every_file_of_tests_has_a_name_of_its_own():  # pytest imports it by that name
    names = [path.name for path in Path(__file__).parents[1].rglob('test_*.py')]
    assert sorted(set(names)) == sorted(names)
