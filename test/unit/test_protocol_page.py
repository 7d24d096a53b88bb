# SPDX-License-Identifier: Apache-2.0
"""The page of the protocol and the checks of its rules agree."""

from pathlib import Path
import re

import pytest

from comply_ros.protocol import check_learner, check_mentor, check_world
from comply_ros.protocol.rule_report import SHOULD

PAGE = (Path(__file__).parents[2] / 'docs/reference/protocol.md').read_text(encoding='utf-8')
# The text of each rule, from its number to the next one or the end of the list.
RULES = dict(re.findall(r'(?ms)^\* \*\*([PWML]\d+)\.\*\* (.*?)(?=^\* |^$)', PAGE))
LIVE = {'P1', 'P2', 'P4', 'P12'}  # those of `nodes/check_common.py`
CHECKED = {*check_world.RULES, *check_mentor.RULES, *check_learner.RULES, *LIVE}


def test_all_rules_are_checked_but_those_that_the_page_names():
    assert RULES.keys() - CHECKED == {'P11', 'L16'}
    assert 'all but P11 and\nL16' in PAGE


def test_no_rule_is_checked_that_is_not_on_the_page():
    assert not CHECKED - RULES.keys()


@pytest.mark.parametrize('rule', sorted(CHECKED))
def test_a_rule_is_checked_as_strictly_as_the_page_says(rule):
    assert ('SHOULD' if rule in SHOULD else 'MUST') in RULES[rule]


def test_the_numbers_of_the_rules_have_no_gap():
    for letter in 'PWML':
        numbers = [int(rule[1:]) for rule in RULES if rule[0] == letter]
        assert numbers == list(range(1, len(numbers) + 1))
