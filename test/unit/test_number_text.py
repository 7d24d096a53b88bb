# SPDX-License-Identifier: Apache-2.0
"""Numbers are read alike on command lines, in settings, maps, sweeps and mentors."""

import pytest

from comply_ros.experiments.sweep_yaml import parse_sweep, SweepFileError
from comply_ros.experiments.train import main as train
from comply_ros.learner.learner_config import ConfigError, LearnerConfig, with_text
from comply_ros.mentor.mentor_spec import MentorError, parse_mentor_spec
from comply_ros.numerics.number_text import NumberError, read_integer, read_number
from comply_ros.storage.map_files import parse_map
from comply_ros.terminal.command_line import CommandParser, real_number, whole_number
from comply_ros.world.grid import MapError

MAP = """
intended: 0.5
step_limit: 50
rewards: {{step: {}, obstacle: -5, goal: 10}}
starts: [[0, 0]]
rows: ['..G', '.#.']
"""
SWEEP = 'methods: sarsa\nmentors: none\nseeds: 1\nsettings: {{initial_value: {}}}\n'
NUMBERS = [('1e-3', 0.001), ('-1e3', -1000.0), ('10', 10), ('-0.5', -0.5), ('+2', 2), ('0', 0),
           ('1.', 1.0), ('.5', 0.5), ('1E+2', 100.0), ('0.010', 0.01), ('1e-09', 1e-9)]
WRONG = ['010', '-01', '00.5', '1:30', '0x10', '1_000', '0b1', '0o7', 'NaN', '.nan', '.inf',
         '1,5', '1e', 'e3', '--1', '\u0661\u0662', '', ' ', '1 2', '9' * 1001]


@pytest.mark.parametrize('text, number', NUMBERS)
def test_a_number_is_the_same_wherever_it_is_written(text, number):
    found = read_number(text)
    assert (found, type(found)) == (number, type(number))
    assert real_number(text) == number
    assert with_text(LearnerConfig(), 'initial_value', text).initial_value == number
    assert parse_sweep(SWEEP.format(text)).axes['initial_value'] == (number,)
    if number < 0:
        assert parse_map(MAP.format(text), 'report').step_reward == number


@pytest.mark.parametrize('text', WRONG)
def test_what_programs_disagree_about_is_no_number_anywhere(text):
    with pytest.raises(NumberError, match='a number must be written like 10, 0.5 or 1e-3, got'):
        read_number(text)
    with pytest.raises(ConfigError, match='initial_value must be a number such as 1.0, got'):
        with_text(LearnerConfig(), 'initial_value', text)
    with pytest.raises(MentorError, match='the P of noisy:P must be a number|is written noisy:P'):
        parse_mentor_spec(f'noisy:{text}')
    if text.isascii() and ',' not in text:
        with pytest.raises(SweepFileError, match=r'line \d+: '):
            parse_sweep(SWEEP.format(text))
        with pytest.raises(MapError):
            parse_map(MAP.format(text), 'report')


def test_what_is_not_finite_is_out_of_range():
    with pytest.raises(ConfigError, match=r'initial_value must lie in .*, got nan'):
        with_text(LearnerConfig(), 'initial_value', 'nan')


@pytest.mark.parametrize('text', ['1.0', '1e3', '010', 'x'])
def test_a_whole_number_has_no_point_and_no_exponent(text):
    with pytest.raises(NumberError):
        read_integer(text)
    with pytest.raises(ConfigError, match=f'episodes must be a whole number, got {text!r}'):
        with_text(LearnerConfig(), 'episodes', text)


@pytest.mark.parametrize('words, found', [
    (['--low', '-1e3'], -1000.0), (['--low=-1e-3'], -0.001), (['--low', '-.5'], -0.5)])
def test_a_negative_number_is_a_value_and_no_option(words, found):
    parser = CommandParser('test')
    parser.add_argument('--low', type=real_number)
    assert parser.parse_args(words).low == found


def test_a_subcommand_takes_a_negative_number_too():
    parser = CommandParser('test')
    command = parser.add_subparsers().add_parser('set')
    command.add_argument('value', type=whole_number)
    assert parser.parse_args(['set', '-10']).value == -10


@pytest.mark.parametrize('option, message', [
    (('--seed', '010'), 'argument --seed: a number must be written like 10, 0.5 or 1e-3, got '
     "'010'"),
    (('--seed', '1.5'), "argument --seed: a whole number must be written like 10, got '1.5'"),
    (('--budget', '1:30'), 'argument --budget: a number must be written like')])
def test_an_option_that_is_no_number_is_named(capsys, option, message):
    with pytest.raises(SystemExit):
        train(['train', *option])
    assert message in capsys.readouterr().err


def test_a_setting_may_be_negative_with_an_exponent(capsys, tmp_path):
    assert train(['train', '--map', 'bar_grid', '--mentor', 'none', '--iterations', '1',
                  '--episodes', '1', '--set', 'initial_value=-1e3', '--out', str(tmp_path)]) == 0
