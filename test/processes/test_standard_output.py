# SPDX-License-Identifier: Apache-2.0
"""Results on standard output, progress on standard error, and a pipe that is closed early."""

import os
import subprocess
import sys

import pytest

START = 'import sys; from comply_ros.executables import {0}; sys.argv[0] = "{0}"; sys.exit({0}())'
SMALL = ('--map', 'bar_grid', '--mentor', 'noisy:0.2', '--iterations', '2', '--episodes', '2')
SWEEP = ('map: bar_grid\nmethods: [sarsa]\nmentors: [none]\nseeds: 1\n'
         'settings: {iterations: 2, episodes: 2}\n')
CLOSED_PIPE = 141  # as a shell has it


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """Stand in a folder with a sweep."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'a.yaml').write_text(SWEEP)
    return tmp_path


def command(name, *arguments, **options):
    """Run a command to its end; return it."""
    return subprocess.run([sys.executable, '-c', START.format(name), *arguments], check=False,
                          text=True, stderr=subprocess.PIPE, **options)


@pytest.mark.parametrize('arguments, result, progress', [
    (('train', *SMALL, '--out', 'a'), 'learned policy', 'beta_implicit'),
    (('sweep', 'a.yaml'), 'runs/a.csv: 1 runs', 'sweep')])
def test_results_are_on_standard_output_and_progress_is_not(arguments, result, progress):
    done = command(*arguments, stdout=subprocess.PIPE)
    assert done.returncode == 0 and result in done.stdout
    assert result not in done.stderr and progress in done.stderr and '━' not in done.stdout


def test_a_closed_pipe_ends_a_help_quietly():
    reader, writer = os.pipe()
    os.close(reader)
    done = command('train', '--help', stdout=writer)
    os.close(writer)
    assert done.stderr == ''


@pytest.mark.parametrize('arguments', [
    ('train', *SMALL, '--out', 'a'), ('sweep', 'a.yaml')])
@pytest.mark.long
def test_a_closed_pipe_ends_a_command_quietly(arguments):
    reader, writer = os.pipe()
    os.close(reader)
    done = command(*arguments, stdout=writer)
    os.close(writer)
    assert (done.returncode, 'rror' in done.stderr) == (CLOSED_PIPE, False), done.stderr


def test_what_was_learned_is_on_disk_when_nobody_reads_the_results(folder):
    reader, writer = os.pipe()
    os.close(reader)
    done = subprocess.run([sys.executable, '-c', START.format('train'), *SMALL, '--out', 'a'],
                          check=False, stdout=writer, stderr=writer)
    os.close(writer)
    assert done.returncode == CLOSED_PIPE
    assert {'summary.json', 'learning.npz', 'mentor.txt'} <= set(os.listdir(folder / 'a'))
