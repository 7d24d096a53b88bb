# SPDX-License-Identifier: Apache-2.0
"""The linters of ament, where a ROS installation has them; ruff checks the same without one."""

from pathlib import Path

import pytest

TOP = Path(__file__).parents[2]
SOURCES = [str(TOP / 'comply_ros'), str(TOP / 'launch')]
# ament_copyright wants a copyright line in each file; ours
# have one SPDX line, which test_package.py checks.


def test_the_style_is_that_of_ament():
    lint = pytest.importorskip('ament_flake8.main', reason='ament_flake8 is not installed')
    failures, lines = lint.main_with_errors(
        argv=['--config', str(TOP / 'test' / 'ament_flake8.ini'), *SOURCES])
    assert failures == 0, '\n'.join(lines)


def test_docstrings_follow_the_rules_of_ament():
    lint = pytest.importorskip('ament_pep257.main', reason='ament_pep257 is not installed')
    assert lint.main(argv=['--add-ignore', 'D401', 'D417', '--', *SOURCES]) == 0


def test_package_xml_is_valid():
    lint = pytest.importorskip('ament_xmllint.main', reason='ament_xmllint is not installed')
    assert lint.main(argv=[str(TOP / 'package.xml'), str(TOP / 'msg_defs' / 'package.xml')]) == 0
