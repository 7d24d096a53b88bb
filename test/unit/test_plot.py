# SPDX-License-Identifier: Apache-2.0
"""Pictures of a bag: of a whole training, of a bag that was cut off, of one with few topics."""

from bag_fixtures import SimulatedRun, write_bag
import matplotlib.image
import pytest

from comply_ros.bags import plot
from comply_ros.protocol.run_reports import RunReports


@pytest.fixture(scope='module')
def messages():
    """Return the messages of a training."""
    return SimulatedRun().messages


def drawn(bag, *argv):
    """Return the names of the pictures; each must be large enough and not blank."""
    assert plot.main(['plot', str(bag), *map(str, argv)]) == 0
    folder = argv[1] if argv else bag.with_name(f'{bag.name}-pictures')
    for path in folder.iterdir():
        pixels = matplotlib.image.imread(path)
        assert pixels.shape[0] > 300 and (pixels.std() > 0.02)
    return sorted(path.name for path in folder.iterdir())


ALL = ['confidence.png', 'episode_lengths.png', 'learning_curve.png', 'trust_map.png']


def test_the_pictures_are_written_beside_the_bag(messages, tmp_path, capsys):
    assert drawn(write_bag(tmp_path / 'bag', messages)) == ALL
    assert capsys.readouterr().out.splitlines() == [
        str(tmp_path / 'bag-pictures' / name)
        for name in ('learning_curve.png', 'confidence.png', 'trust_map.png',
                     'episode_lengths.png')]


def test_a_bag_that_was_cut_off_is_drawn_as_far_as_it_was_read(messages, tmp_path, capsys):
    bag = write_bag(tmp_path / 'bag', messages, chunk=50)
    path = bag / 'bag.mcap'
    path.write_bytes(path.read_bytes()[:path.stat().st_size * 3 // 5])
    assert drawn(bag, '--out', tmp_path / 'out') == ALL[:3]
    assert 'was cut off' in capsys.readouterr().err


@pytest.mark.parametrize('missing, pictures', [
    ('progress', [ALL[1], ALL[3]]), ('episode', [ALL[0], *ALL[2:]]), ('trust', ALL[:3]),
    ('method', ALL)])
def test_a_picture_without_its_messages_is_not_drawn(messages, tmp_path, missing, pictures):
    bag = write_bag(tmp_path / 'bag', [each for each in messages if each[0] != missing])
    assert drawn(bag) == pictures


def test_the_trust_map_of_a_bag_with_several_mentors_has_a_panel_for_each(tmp_path):
    one = matplotlib.image.imread(_drawn_trust(tmp_path / 'one', ['anna']))
    two = matplotlib.image.imread(_drawn_trust(tmp_path / 'two', ['anna', 'bob']))
    three = matplotlib.image.imread(_drawn_trust(tmp_path / 'three', ['anna', 'bob', 'carl']))
    assert abs(one.shape[1] - one.shape[0]) < 200  # the whole picture for the only one
    assert three.shape[1] - two.shape[1] > 0.8 * two.shape[1] / 2.3  # one panel more


def _drawn_trust(folder, mentors):
    run = SimulatedRun(iterations=1, episodes=1, mentors=tuple(mentors))
    messages = [each for each in run.messages if each[0] not in ('progress', 'episode')]
    assert drawn(write_bag(folder, messages)) == ['trust_map.png']
    return folder.with_name(f'{folder.name}-pictures') / 'trust_map.png'


def test_the_confidence_in_each_mentor_of_a_bag_is_drawn(tmp_path, monkeypatch):
    shown = {}
    draw = plot.training_plots.draw_confidence_curves
    monkeypatch.setattr(plot.training_plots, 'draw_confidence_curves',
                        lambda path, curves, summary: (shown.update(curves),
                                                       draw(path, curves, summary)))
    run = SimulatedRun(iterations=3, episodes=4, mentors=('anna', 'bob'))
    assert 'confidence.png' in drawn(write_bag(tmp_path / 'bag', run.messages))
    assert {name: curve.iterations for name, curve in shown.items()} == {
        'anna': (1, 2, 3), 'bob': (1, 2, 3)}
    reported = [msg.confidence for topic, msg in run.messages
                if topic == 'progress' and msg.mentor == 'bob']
    assert shown['bob'].values == tuple(reported)


def test_the_curve_starts_again_with_a_new_learner(messages):
    reports = RunReports(history=True)
    for topic, msg in [*messages, *SimulatedRun(number=6, run=8, iterations=2).messages]:
        reports = plot.add_message(reports, topic, msg)
    assert list(reports.progress_by_iteration) == [1, 2]
    assert {run for run, _ in reports.episodes} == {8}


def test_a_bag_with_nothing_to_draw_is_reported_in_one_line(messages, tmp_path, capsys):
    bag = write_bag(tmp_path / 'bag', messages[:3])
    assert plot.main(['plot', str(bag)]) == 2
    assert capsys.readouterr().err.endswith(
        f'plot: bag {str(bag)!r} has no episode, progress or trust to draw\n')
