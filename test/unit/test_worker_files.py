# SPDX-License-Identifier: Apache-2.0
"""Files of a run on another machine: with all that they name, and nothing of this machine."""

from pathlib import Path

from PIL import Image
import pytest

from comply_ros.experiments.training_runs import Run
from comply_ros.experiments.worker_files import (
    files_of,
    NamedFile,
    read_file,
    ShippingError,
    unpack,
    world_of,
)

NAV2_MAP = """{image: maps/house.pgm, resolution: 0.5, origin: [0, 0, 0], negate: 0,
occupied_thresh: 0.65, free_thresh: 1e-1}"""
MAP_FILE = """{nav2: house.yaml, cell_size: 0.5, starts: [[0.25, 0.25]], goals: [[1.25, 0.25]],
rewards: {step: -1, goal: 9}, slips: {90: 0.1, -90: 0.1}, edges: bump}"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Folder with a map of Nav2 of three cells in a row, and a map file that names it."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'maps').mkdir()
    Image.new('L', (3, 1), 254).save('maps/house.pgm')
    (tmp_path / 'house.yaml').write_text(NAV2_MAP)
    (tmp_path / 'mine.yaml').write_text(MAP_FILE)
    return tmp_path


def shipped(run):
    """Return the files of a run as they are shipped."""
    return {field: read_file(named) for field, named in files_of(run).items()}


@pytest.mark.parametrize('name', [
    'nav2:house.yaml?start=0.25,0.25&goal=1.25,0.25&cell_size=0.5', 'mine.yaml'])
def test_a_map_of_nav2_is_read_where_its_files_are_not(folder, name):
    run = Run(name)
    files, world = shipped(run), world_of(run)
    for path in ('maps/house.pgm', 'house.yaml', 'mine.yaml'):
        (folder / path).unlink()
    unpacked = unpack(run, files, world)
    assert unpacked.map != name and str(folder) not in unpacked.map
    assert world_of(unpacked) == world


def test_another_image_is_another_file(folder):
    before = read_file(NamedFile('mine.yaml', ('nav2', 'image')))
    Image.new('L', (3, 1), 253).save('maps/house.pgm')
    after = read_file(NamedFile('mine.yaml', ('nav2', 'image')))
    assert before.content == after.content and before.sha256 != after.sha256


def test_a_file_that_names_no_other_is_shipped_as_it_is(folder):
    (folder / 'plain.yaml').write_text('{starts: anywhere}  # no nav2')
    file = read_file(NamedFile('plain.yaml', ('nav2', 'image')))
    assert file.named is None and file.content == b'{starts: anywhere}  # no nav2'
    assert files_of(Run('bar_grid')) == {}
    assert files_of(Run('bar_grid', mentor='file:a.txt@0.5')) == {'mentor': NamedFile('a.txt')}


def test_a_world_that_is_another_one_there_is_rejected(folder):
    run = Run('mine.yaml')
    with pytest.raises(ShippingError, match="map 'mine.yaml' must be the same on all machines"):
        unpack(run, shipped(run), 64 * '0')


def test_each_of_several_mentors_from_files_is_shipped(folder):
    (folder / 'a.txt').write_text('first')
    (folder / 'b.txt').write_text('second')
    run = Run('mine.yaml', mentor='anna=file:a.txt + random + file:b.txt@0.5')
    assert list(files_of(run)) == ['map', 'mentor:anna', 'mentor:b']
    there = unpack(run, shipped(run), world_of(run))
    anna, random, b = there.mentor.split(' + ')
    assert random == 'random=random' and b.endswith('@0.5')
    for text, name, content in ((anna, 'anna', 'first'), (b.removesuffix('@0.5'), 'b', 'second')):
        assert text.startswith(f'{name}=file:')
        assert Path(text.partition('file:')[2]).read_text() == content
