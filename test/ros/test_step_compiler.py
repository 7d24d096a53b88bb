# SPDX-License-Identifier: Apache-2.0
"""Machine code for a node's learner with a model: when it comes, and where it does not."""

from pathlib import Path
import sys

import numpy as np
import pytest
from tiny_worlds import corridor
from waiting import wait_until

from comply_ros.learner.agent import Agent
from comply_ros.learner.learner_config import LearnerConfig
from comply_ros.learner.step_kernels import PLAIN
from comply_ros.nodes.step_compiler import load_kernels, release_code, StepCompiler
from comply_ros.numerics import jit


class Logger:
    """Keeps what is logged."""

    def __init__(self):
        self.texts = []

    def info(self, text):
        """Keep a text."""
        self.texts.append(text)

    warning = info


@pytest.fixture
def agent():
    """Return an agent with a model, in the corridor."""
    agent = Agent(LearnerConfig(learns_model=True), seed=0)
    agent.start(corridor())
    return agent


def first_text(agent):
    """Return the first text that a compiler logs, ticked until it does."""
    logger = Logger()
    compiler = StepCompiler(logger)

    def text():
        compiler.tick(agent)
        return logger.texts
    return wait_until(text, 'text')[0]


@pytest.mark.long
def test_a_node_steps_in_machine_code_once_it_is_compiled(agent):
    assert first_text(agent) == 'steps in machine code from now on'
    assert agent.runs_machine_code


def test_where_it_cannot_be_compiled_the_node_says_so_once_and_goes_on(
        agent, tmp_path, monkeypatch):
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path))
    jit.compiled.cache_clear()
    failing = tmp_path / 'python'
    failing.write_text('#!/bin/sh\necho no memory >&2\nexit 3\n')
    failing.chmod(0o755)
    monkeypatch.setattr(sys, 'executable', str(failing))
    assert first_text(agent) == ('goes on in plain Python, which is slower: the compiler ended '
                                 'with code 3: no memory')
    assert not agent.runs_machine_code
    jit.compiled.cache_clear()


def test_without_a_cache_nothing_is_compiled(agent, tmp_path, monkeypatch):
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path / 'file'))
    (tmp_path / 'file').write_text('a file where a folder should be')
    assert load_kernels(agent.kernel_config, agent.state) is PLAIN


def test_for_a_learner_without_a_model_nothing_is_loaded():
    plain = Agent(LearnerConfig(), seed=0)
    plain.start(corridor())
    compiler = StepCompiler(Logger())
    compiler.tick(plain)
    assert not compiler._loaded


def code_in_memory(library):
    """Return the kB of a library's code that this process has in memory."""
    lines, found = iter(Path('/proc/self/smaps').read_text().splitlines()), 0
    for line in lines:
        if 'r-xp' in line and library in line:
            found += next(int(each.split()[1]) for each in lines if each.startswith('Rss:'))
    return found


def test_code_that_is_released_is_out_of_memory_until_it_is_called():
    library = '_multiarray_umath'
    assert np.sort(np.array([3.0, 1.0, 2.0])).tolist() == [1.0, 2.0, 3.0]
    before = code_in_memory(library)
    release_code(library)
    assert code_in_memory(library) < before
    assert np.sort(np.array([3.0, 1.0, 2.0])).tolist() == [1.0, 2.0, 3.0]
