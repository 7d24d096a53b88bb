# SPDX-License-Identifier: Apache-2.0
"""docs/tutorial.md: every command prints what the page says."""

from pathlib import Path
import re
import shutil
import socket

from doc_runner import Block, blocks, DocRunner, EndedError, fences, pattern
import pytest

TOP = Path(__file__).parents[2]
PAGE = (TOP / 'docs' / 'tutorial.md').read_text()
ROS2 = {'scripts/run': 'ros2 run comply_ros', 'scripts/topic': 'ros2 topic',
        'scripts/service': 'ros2 service', 'scripts/param': 'ros2 param',
        'scripts/python': 'python3'}


@pytest.fixture
def folder(tmp_path):
    """Return a copy of this folder for whoever types commands in it; results stay there."""
    (tmp_path / 'scripts').mkdir()
    for path in (TOP / 'scripts').iterdir():
        script = tmp_path / 'scripts' / path.name
        script.write_text(f'#!/bin/sh\nexec {path} "$@"\n')
        script.chmod(0o755)
    shutil.copytree(TOP / 'examples', tmp_path / 'examples')
    return tmp_path


@pytest.mark.long
def test_every_command_prints_what_the_page_says(domain, folder):
    # Another process may have the port of the page.
    with socket.create_server(('localhost', 0)) as free:
        page = PAGE.replace('8080', str(free.getsockname()[1]))
    with DocRunner(folder) as runner:
        for block in blocks(page):
            runner.run(block)


@pytest.mark.parametrize('fence', [each for each in fences(PAGE) if each.language == 'bash'],
                         ids=lambda fence: f'line_{fence.line}')
def test_each_command_has_its_ros2_command_beside_it(fence):
    written = '\n'.join(fence.lines)
    for line in fence.lines:
        command = re.sub(r'\s+# .*', '', line)
        tool, _, rest = command.partition(' ')
        if tool in ROS2:
            assert f'# {ROS2[tool]} {rest}\n' in written + '\n'


def test_every_block_on_the_page_is_read():
    languages = [each.language for each in fences(PAGE)]
    assert set(languages) == {'bash', 'text', 'python'}
    assert len([block for block in blocks(PAGE) if block.commands or block.ends]) \
        == languages.count('bash') > 5


def test_the_mentor_on_the_page_is_the_one_of_the_examples():
    code, = ('\n'.join(each.lines) + '\n' for each in fences(PAGE) if each.language == 'python')
    own = (TOP / 'examples' / 'own_mentor.py').read_text()
    assert code in own
    assert own.removesuffix(code).count('\n') == 1  # the licence
    assert len([line for line in code.splitlines() if line]) <= 35


def test_the_mentor_of_the_examples_needs_only_rclpy_and_the_messages():
    own = (TOP / 'examples' / 'own_mentor.py').read_text()
    assert set(re.findall(r'^(?:from|import) (\w+)', own, re.MULTILINE)) == {
        'comply_msgs', 'rclpy'}


def test_blocks_have_terminals_commands_and_expected_output():
    page = ('x\n```bash\n# terminal 2\necho a  # ros2 a\n```\ny\n```text\na ...\n```\n'
            '```bash\necho b\n```\n```text\n# terminal 2\nc\n```\n'
            '```bash\n# terminal 2: Ctrl-C\n```\n')
    assert blocks(page) == [Block(2, '2', False, ('echo a',), ('a ...',)),
                            Block(10, None, False, ('echo b',), ()),
                            Block(13, '2', False, (), ('c',)),
                            Block(17, '2', True, (), ())]


@pytest.mark.parametrize('expected, output, is_shown', [
    (['a ... c'], 'x\na b c\n', True), (['a'], 'ab\n', False), (['a', 'c'], 'a\nb\nc\n', False),
    (['a', '...', 'c'], 'a\nb\nb\nc\n', True), (['a', '...', 'c'], 'a\nc\n', True),
    (['(.)'], '(a)\n', False)])
def test_only_three_dots_stand_for_any_text(expected, output, is_shown):
    assert bool(pattern(expected).search(output)) == is_shown


@pytest.mark.parametrize('block, error', [
    (Block(3, None, False, ('echo a',), ('b',)), 'line 3: echo a\nshows\na\n\nand not\nb'),
    (Block(3, None, False, ('false',), ()), 'line 3: false'),
    (Block(3, '1', False, ('echo a',), ('b',)), 'line 3: echo a ended:\na')])
def test_a_command_with_other_output_is_reported_with_its_line(tmp_path, block, error):
    with pytest.raises((AssertionError, EndedError)) as failure, DocRunner(tmp_path) as runner:
        runner.run(block)
    assert error in str(failure.value)


def test_a_running_command_is_ended_by_the_next_one_and_by_ctrl_c(tmp_path):
    with DocRunner(tmp_path) as runner:
        first = Block(1, '1', False, ('bash -c "echo a; exec sleep 60"',), ('a',))
        runner.run(first)
        runner.run(first._replace(line=2))
        runner.run(Block(2, '1', False, (), ('a',)))
        runner.run(Block(3, '1', True, (), ()))
        assert runner.running == {}
