# SPDX-License-Identifier: Apache-2.0
"""README, CONTRIBUTING and docs/: links lead somewhere, names exist, versions agree."""

from collections import Counter
from importlib import import_module
import json
import os
from pathlib import Path
import re
import subprocess
import sys

import pytest
from waiting import DEADLINE
import yaml

from comply_ros.experiments import train
from tools.docstring_text import separate_entries

TOP = Path(__file__).parents[2]
DOCS = TOP / 'docs'
PAGES = [TOP / 'README.md', TOP / 'CONTRIBUTING.md', *sorted(DOCS.rglob('*.md'))]
LINK = re.compile(r'\]\(([^)\s]+)\)|(?:src|href)="([^"]+)"')


def without_code(text: str) -> str:
    """Text of a page without its code."""
    return re.sub(r'`[^`\n]*`', '', re.sub(r'```.*?```', '', text, flags=re.DOTALL))


def links(page: Path) -> list[str]:
    """Links of a page that do not leave this repository."""
    found = [markdown or html for markdown, html in LINK.findall(without_code(page.read_text()))]
    return [link for link in found if not link.startswith(('http://', 'https://'))]


def anchors(page: Path) -> set[str]:
    """Anchors of the headings of a page, as GitHub names them."""
    seen: Counter[str] = Counter()
    found = set()
    text = re.sub(r'```.*?```', '', page.read_text(), flags=re.DOTALL)
    for heading in re.findall(r'^#+ (.*)$', text, re.MULTILINE):
        name = re.sub(r'[^\w\- ]', '', heading.lower()).replace(' ', '-')
        found.add(f'{name}-{seen[name]}' if seen[name] else name)
        seen[name] += 1
    return found


def broken_links(page: Path) -> list[str]:
    """Links of a page whose file or anchor does not exist."""
    broken = []
    for link in links(page):
        path, _, anchor = link.partition('#')
        target = (page.parent / path).resolve() if path else page
        if not target.exists() or (anchor and anchor not in anchors(target)):
            broken.append(link)
    return broken


@pytest.mark.parametrize('page', PAGES, ids=lambda page: str(page.relative_to(TOP)))
def test_every_link_leads_to_a_file_and_a_heading(page):
    assert broken_links(page) == []


def test_a_link_to_nothing_is_found(tmp_path):
    page = tmp_path / 'page.md'
    page.write_text('# A head: of `x`\n## A\n## A\n[a](#a-head-of-x) [b](#a-1) [c](#a-2)\n'
                    '[d](d.md) `[e](e.md)` <img src="f.png"> [g](https://example.org)\n')
    assert broken_links(page) == ['#a-2', 'd.md', 'f.png']


def test_every_page_is_in_the_navigation_of_the_site():
    def files(entries):
        for entry in entries:
            for value in entry.values():
                yield from [value] if isinstance(value, str) else files(value)
    listed = sorted(files(yaml.safe_load((TOP / 'mkdocs.yml').read_text())['nav']))
    assert listed == sorted(str(page.relative_to(DOCS)) for page in DOCS.rglob('*.md'))


def test_pages_of_the_site_link_only_to_pages_of_the_site():
    for page in DOCS.rglob('*.md'):
        for link in links(page):
            assert (page.parent / link.partition('#')[0]).resolve().is_relative_to(DOCS), page


def test_every_name_of_the_python_page_exists():
    page = (DOCS / 'reference' / 'python.md').read_text()
    names = re.findall(r'^::: (\S+)$', page, re.MULTILINE)
    assert names
    for name in names:
        module, _, attribute = name.rpartition('.')
        assert getattr(import_module(module), attribute).__doc__


def run_python(page: str, number: int, folder: Path) -> str:
    """Output of a Python block of a page; its files are in the folder."""
    code = re.findall(r'```python\n(.*?)```', (TOP / page).read_text(), re.DOTALL)[number]
    done = subprocess.run([sys.executable, '-c', code], cwd=folder, capture_output=True,
                          text=True, timeout=DEADLINE, check=False,
                          env={**os.environ, 'MPLBACKEND': 'Agg'})
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize('page', [
    'README.md', pytest.param('docs/reference/python.md', marks=pytest.mark.long)])
def test_the_first_python_lines_of_a_page_train_a_learner(page, tmp_path):
    assert float(run_python(page, 0, tmp_path).split()[0]) > 0.0
    assert list((tmp_path / 'runs' / 'first').iterdir())


def test_the_page_on_gymnasium_makes_an_environment_of_a_map(tmp_path):
    pytest.importorskip('gymnasium')
    assert run_python('docs/how-to/gymnasium.md', 0, tmp_path) == ''


@pytest.mark.long
def test_the_page_on_learned_policies_shows_what_its_python_lines_print(tmp_path):
    printed = run_python('docs/how-to/learned.md', 0, tmp_path).split()
    text = ' '.join((DOCS / 'how-to' / 'learned.md').read_text().rpartition('```')[2].split())
    shown = re.findall(r'[\d.]+\d', text.replace('600 episodes', 'episodes'))
    assert [f'{float(each):.2f}' for each in printed[:2]] == shown[:2]
    assert [f'{float(each):.0f}' for each in printed[2:]] == shown[2:]


@pytest.mark.long
def test_the_python_page_shows_a_training_with_the_same_digest_as_train(tmp_path):
    *returns, digest = run_python('docs/reference/python.md', 1, tmp_path).split()
    assert len(returns) == 50
    options = ('--mentor', 'noisy:0.2', '--method', 'explicit', '--iterations', '50')
    assert train.main(['train', *options, '--seed', '3', '--out', str(tmp_path)]) == 0
    assert json.loads((tmp_path / 'summary.json').read_text())['digest'] == digest


@pytest.mark.long
def test_the_python_page_shows_a_training_in_a_table(tmp_path):
    # The best is to run the machine until it is worn, and to stop then: V0 = 2 + V0 / 2
    learned = float(run_python('docs/reference/python.md', 2, tmp_path))
    assert learned == pytest.approx(4.0)


def test_the_readme_is_short():
    assert len((TOP / 'README.md').read_text().splitlines()) <= 150


@pytest.mark.parametrize('file', ['.pre-commit-config.yaml', 'requirements/docs.txt'])
def test_ruff_has_one_version(file):
    pinned = re.search(r'ruff==[\d.]+', (TOP / 'requirements' / 'test.txt').read_text())[0]
    assert re.findall(r'ruff==[\d.]+', (TOP / file).read_text()) == [pinned]


def test_the_citation_has_the_version_of_the_package():
    package = re.search(r'<version>(.*)</version>', (TOP / 'package.xml').read_text())[1]
    assert yaml.safe_load((TOP / 'CITATION.cff').read_text())['version'] == package


def test_entries_of_a_docstring_have_their_text_on_a_line_of_its_own():
    assert separate_entries(
        'A line: not an entry.\n\nParameters\n----------\na, b: two\n    more: lines\n\n'
        'Raises\n------\nValueError: if not.\n\nNotes\n-----\nA line: not an entry.') == (
        'A line: not an entry.\n\nParameters\n----------\na, b\n    two\n    more: lines\n\n'
        'Raises\n------\nValueError\n    if not.\n\nNotes\n-----\nA line: not an entry.')
