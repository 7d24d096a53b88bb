# SPDX-License-Identifier: Apache-2.0
"""Pictures from a bag alone: of a whole run, of one that was cut off, of one that says little."""

from bag_fixtures import Held, write
import matplotlib.image
import pytest

from comply_ros.bags import plot


@pytest.fixture(scope='module')
def spoken():
    """Return what was said in a conversation."""
    return Held().spoken


def drawn(bag, *argv):
    """Return the names of the pictures, each looked at."""
    assert plot.main(['plot', str(bag), *map(str, argv)]) == 0
    folder = argv[1] if argv else bag.with_name(f'{bag.name}-pictures')
    for path in folder.iterdir():
        pixels = matplotlib.image.imread(path)
        assert pixels.shape[0] > 300 and (pixels.std() > 0.02)
    return sorted(path.name for path in folder.iterdir())


ALL = ['episode_lengths.png', 'learning_curve.png', 'trust_map.png']


def test_a_bag_is_drawn_beside_it(spoken, tmp_path, capsys):
    assert drawn(write(tmp_path / 'bag', spoken)) == ALL
    assert capsys.readouterr().out.splitlines() == [
        str(tmp_path / 'bag-pictures' / name)
        for name in ('learning_curve.png', 'trust_map.png', 'episode_lengths.png')]


def test_a_bag_that_was_cut_off_is_drawn_as_far_as_it_goes(spoken, tmp_path, capsys):
    bag = write(tmp_path / 'bag', spoken, flushes=50)
    path = bag / 'bag.mcap'
    path.write_bytes(path.read_bytes()[:path.stat().st_size * 3 // 5])
    assert drawn(bag, '--out', tmp_path / 'out') == ALL[:2]
    assert 'was cut off' in capsys.readouterr().err


@pytest.mark.parametrize('missing, pictures', [
    ('progress', [ALL[0], ALL[2]]), ('episode', ALL[1:]), ('trust', ALL[:2]),
    ('mentor_policy', ALL), ('method', ALL), ('state', ALL)])
def test_what_is_missing_is_not_drawn(spoken, tmp_path, missing, pictures):
    bag = write(tmp_path / 'bag', [each for each in spoken if each[0] != missing])
    assert drawn(bag) == pictures


def test_the_curve_begins_anew_with_a_learner_that_does(spoken):
    reports = plot.Reports()
    for topic, msg in [*spoken, *Held(number=6, run=8, iterations=2).spoken]:
        reports.hear(topic, msg)
    assert list(reports.progress) == [1, 2]
    assert {run for run, _ in reports.episodes} == {8}


def test_nothing_to_draw_is_one_sentence(spoken, tmp_path, capsys):
    bag = write(tmp_path / 'bag', spoken[:3])
    assert plot.main(['plot', str(bag)]) == 2
    assert capsys.readouterr().err.endswith(
        f'plot: bag {str(bag)!r} has no episode, no iteration and no trust to draw\n')
