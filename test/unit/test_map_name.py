# SPDX-License-Identifier: Apache-2.0
"""What a name of a map says."""

import pytest

from comply_ros.storage.map_name import absolute_name, file_stem, map_title, parse_map_name
from comply_ros.world.grid import MapError


def test_a_file_may_have_the_name_of_a_library():
    assert parse_map_name('gym') == ('', 'gym', {})
    assert len(map_title('gym:FrozenLake-v1?desc=' + 400 * 'F')) == 255
    assert file_stem('gym:Taxi-v4?is_rainy=true') == 'gym_Taxi-v4_is_rainy_true'


def test_a_random_world_is_no_file():
    assert parse_map_name('garnet:7') == ('garnet', '7', {})
    assert map_title('garnet:7') == absolute_name('garnet:7') == 'garnet:7'
    assert file_stem('garnet:7') == 'garnet_7'


@pytest.mark.parametrize('name, target', [
    ('nav2:my%20house.yaml?start=1,2', 'my house.yaml'), ('nav2:100%25.yaml', '100%.yaml'),
    ('nav2:why%3F.yaml?start=1,2', 'why?.yaml'), ('nav2:100%.yaml', '100%.yaml'),
    ('why%3F.yaml', 'why%3F.yaml')])  # without a scheme, a name is a path as it is
def test_signs_of_a_path_can_be_written_as_in_an_address(name, target):
    assert parse_map_name(name).target == target


@pytest.mark.parametrize('name', ['nav2:%FF.yaml', 'gym:Taxi-v4?text=%FF.yaml'])
def test_bytes_that_are_no_text_are_rejected(name):
    with pytest.raises(MapError, match=r"%XX must be bytes of UTF-8, got '%FF\.yaml'"):
        parse_map_name(name)


def test_an_absolute_name_means_the_same_file_whatever_its_folder_is_called(
        tmp_path, monkeypatch):
    folder = tmp_path / '50%3F ?'
    folder.mkdir()
    monkeypatch.chdir(folder)
    name = absolute_name('nav2:100%25.yaml?start=1,2&goal=%33,4')
    assert parse_map_name(name) == ('nav2', f'{folder}/100%.yaml', {'start': '1,2', 'goal': '3,4'})
    assert absolute_name(name) == name
    assert map_title(name) == '100%'
