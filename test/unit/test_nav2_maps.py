# SPDX-License-Identifier: Apache-2.0
"""Maps of Nav2's map_server, on images of a few pixels."""

import numpy as np
from PIL import Image
import pytest
from table_planning import outcomes

from comply_ros.storage.map_files import parse_map, read_map
from comply_ros.storage.nav2_maps import nav2_rows, nav2_state, Nav2Map, read_nav2_map
from comply_ros.world.grid import MapError
from comply_ros.world.transition_table import Table

HEADER = """
image: house.pgm
resolution: 0.25
origin: [-1.0, 2.0, 0.0]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.25
"""
BLACK, GRAY, WHITE = 0, 128, 254
# Top row first; with two pixels a cell, the upper right cell is occupied, the lower left free.
PIXELS = [[WHITE, WHITE, WHITE, BLACK],
          [WHITE, WHITE, WHITE, WHITE],
          [WHITE, WHITE, WHITE, WHITE],
          [WHITE, WHITE, WHITE, WHITE]]


def write_map(folder, pixels=PIXELS, header=HEADER, name='house.pgm'):
    """Write a map, with an image of 8 bits; return the path of its YAML file."""
    Image.fromarray(np.array(pixels, dtype=np.uint8)).save(folder / name)
    (folder / 'house.yaml').write_text(header)
    return str(folder / 'house.yaml')


def occupancy(folder, pixels, old='', new='', name='house.pgm'):
    header = HEADER.replace(old, new) if old else HEADER
    return read_nav2_map(write_map(
        folder, pixels, header.replace('house.pgm', name), name)).occupancy.tolist()


def test_the_rows_of_an_image_are_read_from_the_bottom(tmp_path):
    assert occupancy(tmp_path, [[BLACK, GRAY], [WHITE, WHITE]]) == [[0, 0], [100, -1]]


def test_the_header_has_resolution_and_origin(tmp_path):
    nav2 = read_nav2_map(write_map(tmp_path))
    assert (nav2.resolution, nav2.origin) == (0.25, (-1.0, 2.0, 0.0))


@pytest.mark.parametrize('text', ['P2\n# by hand\n3 1\n255\n0 128 254\n',
                                  'P2 3 1 15 0 8 15'])
def test_a_pgm_file_can_be_text_with_a_comment_and_any_largest_value(tmp_path, text):
    path = write_map(tmp_path)
    (tmp_path / 'house.pgm').write_text(text)
    assert read_nav2_map(path).occupancy.tolist() == [[100, -1, 0]]


def test_negate_takes_white_for_occupied(tmp_path):
    assert occupancy(tmp_path, [[0, 128, 255]], 'negate: 0', 'negate: 1') == [[0, -1, 100]]


def test_the_thresholds_themselves_are_unknown(tmp_path):
    # occupied: 1 - 51/255 = 0.8, 1 - 204/255 = 0.2
    pixels = [[50, 51, 52, 203, 204, 205]]
    header = HEADER.replace('0.65', '0.8').replace('0.25\n', '0.2\n').replace(
        'resolution: 0.2\n', 'resolution: 0.25\n')
    found = read_nav2_map(write_map(tmp_path, pixels, header)).occupancy.tolist()[0]
    assert (found[0], found[2], found[3], found[5]) == (100, -1, -1, 0)


def test_scale_gives_percent_between_the_thresholds(tmp_path):
    # occupied: 1 - 140/255 = 0.45098; (0.45098 - 0.25) / 0.4 = 50.2 percent
    assert occupancy(tmp_path, [[0, 140, 255]], 'negate: 0', 'negate: 0\nmode: scale') == [
        [100, 50, 0]]


def test_raw_takes_values_up_to_100_as_they_are(tmp_path):
    assert occupancy(tmp_path, [[0, 42, 100, 101]], 'negate: 0', 'negate: 0\nmode: raw') == [
        [0, 42, 100, -1]]


def test_of_a_png_the_colors_count_as_their_mean(tmp_path):
    pixels = [[[255, 255, 255], [0, 0, 0], [255, 128, 0]]]
    assert occupancy(tmp_path, pixels, name='house.png') == [[0, 100, -1]]


def test_in_scale_what_is_transparent_is_unknown_and_in_trinary_opacity_is_a_color(tmp_path):
    pixels = [[[255, 255, 255, 254], [0, 0, 0, 255]]]
    assert occupancy(tmp_path, pixels, 'negate: 0', 'negate: 0\nmode: scale', 'house.png') == [
        [-1, 100]]
    # trinary: (0 + 0 + 0 + 255) / 4 / 255 = 0.25, so 0.75 occupied; of opacity 0: 1.0
    assert occupancy(tmp_path, pixels, name='house.png') == [[0, 100]]


def test_a_png_can_have_16_bits(tmp_path):
    path = write_map(tmp_path, header=HEADER.replace('pgm', 'png'))
    Image.fromarray(np.array([[0, 32768, 65535]], dtype=np.uint16)).save(tmp_path / 'house.png')
    assert read_nav2_map(path).occupancy.tolist() == [[100, -1, 0]]


def nav2(pixels, resolution=0.25, origin=(0.0, 0.0, 0.0)):
    return Nav2Map(np.array(pixels, dtype=np.int8), resolution, origin)


def test_a_cell_is_free_if_all_of_its_pixels_are():
    found = nav2([[0, 0, 0, 0, 0, -1], [0, 0, 99, 0, 0, 0], [0, 0, 0, 0, 0, 0],
                  [100, 0, 0, 0, 0, 0]])  # from the bottom
    assert nav2_rows(found, 0.5, [(0.75, 0.25)]) == ['#..', '.G#']


def test_a_cell_that_the_image_fills_in_part_only_is_not_free():
    assert nav2_rows(nav2([[0, 0, 0]] * 2), 0.5, []) == ['.#']


def test_points_are_in_metres_from_the_origin():
    found = nav2([[0] * 4] * 4, origin=(-1.0, 2.0, 0.0))
    assert nav2_state(found, 0.5, (-0.9, 2.1), 'start') == 0
    assert nav2_state(found, 0.5, (-0.1, 2.9), 'start') == 3


def test_points_are_on_a_map_that_is_turned():
    found = nav2([[0] * 6] * 2, origin=(0.0, 0.0, np.pi / 2))  # 1.5 m up, 0.5 m to the left
    assert nav2_state(found, 0.5, (-0.25, 1.25), 'start') == 2


def test_a_map_of_nav2_is_a_world(tmp_path):
    path = write_map(tmp_path)
    world = read_map(f'nav2:{path}?start=-0.75,2.25&goal=-0.25,2.25', 'published')
    assert type(world) is Table
    assert (world.cells, world.starts) == (('.', 'G', '.', '#'), (0,))
    assert world.positions.tolist() == [[-0.75, 2.25], [-0.25, 2.25], [-0.75, 2.75],
                                        [-0.25, 2.75]]
    assert outcomes(world, 0, 'right') == {(1, 10.0): 1.0}
    assert outcomes(world, 2, 'right') == {(2, -5.0): 1.0}
    assert outcomes(world, 0, 'left') == {(0, -0.1): 1.0}
    assert world.step_limit == 40


def test_a_map_file_can_name_a_map_of_nav2_beside_it(tmp_path):
    write_map(tmp_path)
    (tmp_path / 'mine.yaml').write_text(
        'nav2: house.yaml\ncell_size: 0.25\nstarts: [[-0.9, 2.1]]\ngoals: [[-0.1, 2.1]]\n'
        'rewards: {step: -1, goal: 5}\nslips: right_angles\nintended: 0.8\nmoves: 8\n')
    world = read_map(str(tmp_path / 'mine.yaml'), 'published')
    assert len(world.terminal) == 16
    assert world.terminal.nonzero()[0].tolist() == [3]
    assert len(world.actions) == 8


@pytest.mark.parametrize('old, new, message', [
    ('image: house.pgm\n', '', "a map of Nav2 needs the key 'image'"),
    ('image: house.pgm', 'image: 5', 'image must be the name of a file, got 5'),
    ('image: house.pgm', 'image: no.pgm', "image 'no.pgm' must be a PGM or PNG file (no such file "
     'or directory)'),
    ('image: house.pgm', 'image: house.yaml', "image 'house.yaml' must be a PGM or PNG file "
     '(it is of another format)'),
    ('resolution: 0.25', 'resolution: 0', 'resolution must lie above 0 and be at most 1000000 '
     'metres, got 0'),
    ('[-1.0, 2.0, 0.0]', '[-1.0, 2.0]',
     'origin must be [x, y, yaw], in metres and radians, got [-1.0, 2.0]'),
    ('negate: 0', 'negate: 2', 'negate must be 0 or 1, got 2'),
    ('negate: 0', 'negate: 0\nmode: gray',
     "mode must be one of trinary, scale, raw, got 'gray'"),
    ('0.65', '0.2', 'the thresholds must be 0 <= free_thresh < occupied_thresh <= 1, '
     'got 0.25 and 0.2'),
    ('0.65', 'high', "occupied_thresh must be a number, got 'high'"),
    (HEADER, '[1]', 'a map of Nav2 must be a table of image, resolution, origin, '
     'occupied_thresh, free_thresh, negate, got list'),
    (HEADER, '[', 'a map of Nav2 must be valid YAML'),
])
def test_a_wrong_file_of_a_map_is_rejected_with_the_rule_that_it_breaks(tmp_path, old, new,
                                                                       message):
    assert old in HEADER
    with pytest.raises(MapError) as error:
        read_nav2_map(write_map(tmp_path, header=HEADER.replace(old, new)))
    assert str(error.value).startswith(message)
    assert str(error.value).isprintable()


@pytest.mark.parametrize('content, reason', [
    (b'', 'it is of another format'), (b'P5 4 4 255\n\0\0', 'it is cut off or damaged'),
    (b'P2 2 1 255 0 x', 'it is cut off or damaged'),
    (b'P5 20000 20000 255\n', 'it has too many pixels'),
    (b'\x89PNG\r\n\x1a\n' + b'\0' * 40, 'it is of another format')])
def test_an_image_that_is_cut_off_or_no_image_is_rejected(tmp_path, content, reason):
    path = write_map(tmp_path)
    (tmp_path / 'house.pgm').write_bytes(content)
    with pytest.raises(MapError) as error:
        read_nav2_map(path)
    assert str(error.value) == f"image 'house.pgm' must be a PGM or PNG file ({reason})"


def test_an_image_of_too_many_pixels_is_rejected_before_it_is_read(tmp_path):
    path = write_map(tmp_path)
    (tmp_path / 'house.pgm').write_bytes(b'P5 8001 8000 255\n')
    with pytest.raises(MapError) as error:
        read_nav2_map(path)
    assert str(error.value) == ("image 'house.pgm' may have at most 64000000 pixels, "
                                'got 8001 x 8000')


@pytest.mark.parametrize('changes, message', [
    ({'start': None}, 'a map of Nav2 needs a start in metres, such as nav2:house.yaml?'
     'start=-2.0,-0.5&goal=3.0,1.0, got none'),
    ({'goal': None}, 'a map of Nav2 needs a goal in metres, such as nav2:house.yaml?'
     'start=-2.0,-0.5&goal=3.0,1.0, got none'),
    ({'end': 3}, "a map of Nav2 has the arguments start, goal, cell_size, got 'end'"),
    ({'cell_size': 0.3}, 'cell_size must be a multiple of the resolution of 0.25 metres, got 0.3'),
    ({'cell_size': 0.1}, 'cell_size must be a multiple of the resolution of 0.25 metres, got 0.1'),
    ({'start': '5.0,5.0'}, 'a start must lie on the map of 1 x 1 metres at (-1, 2), got (5, 5)'),
    ({'goal': '-0.25,2.75'}, 'a goal must lie in a free cell, but in that of (-0.25, 2.75) '
     'something is occupied or unknown'),
    ({'start': 'nan,0.0'}, 'starts must be a list of [x, y] in metres, got [[nan, 0.0]]'),
    ({'start': 'here'}, "starts must be a list of [x, y] in metres, got ['here']"),
    ({'start': '-0.25,2.25'}, "a start must be a cell where an episode can begin, but (1, 0) is "
     "'G'"),
])
def test_a_wrong_parameter_is_rejected_with_the_rule_that_it_breaks(tmp_path, changes, message):
    arguments = {'start': '-0.75,2.25', 'goal': '-0.25,2.25', **changes}
    name = f'nav2:{write_map(tmp_path)}?' + '&'.join(
        f'{key}={value}' for key, value in arguments.items() if value is not None)
    with pytest.raises(MapError) as error:
        read_map(name, 'published')
    assert str(error.value) == f'map {name!r}: {message}'


def test_a_map_of_nav2_that_does_not_exist_is_named():
    name = 'nav2:nowhere.yaml?start=[0, 0]&goal=[1, 0]'
    with pytest.raises(MapError) as error:
        read_map(name, 'published')
    assert str(error.value) == (f'map {name!r}: a map of Nav2 must be a readable YAML file, '
                                'which names its image (no such file or directory)')


@pytest.mark.parametrize('text, message', [
    ('nav2: a.yaml', "a map with nav2 needs the key 'rewards'"),
    ('nav2: a.yaml\nrewards: {}\nstarts: []', "a map with nav2 needs the key 'goals'"),
    ("nav2: a.yaml\nrewards: {}\nstarts: []\ngoals: []\nrows: ['.']",
     'a map needs either nav2 or rows, got both'),
    ('nav2: 5\nrewards: {}\nstarts: []\ngoals: []',
     'nav2 must be the path of a map of Nav2, got 5'),
    ('nav2: "a\\0b"\nrewards: {}\nstarts: []\ngoals: []',
     'a map of Nav2 must be a readable YAML file, which names its image (no '
     'file can have this name)'),
])
def test_a_wrong_map_file_with_nav2_is_rejected_with_the_rule_that_it_breaks(text, message):
    with pytest.raises(MapError) as error:
        parse_map(text, 'report')
    assert str(error.value) == message


@pytest.mark.parametrize('key, value, message', [
    ('starts', 'anywhere', "starts must be a list of [x, y] in metres, got 'anywhere'"),
    ('goals', '[]', 'goals must be a list of [x, y] in metres, got []'),
    ('goals', '[[1]]', 'goals must be a list of [x, y] in metres, got [[1]]'),
    ('cell_size', 'big', "cell_size must be a number, got 'big'")])
def test_wrong_points_are_rejected(tmp_path, key, value, message):
    keys = {'starts': '[[-0.75, 2.25]]', 'goals': '[[-0.25, 2.25]]', 'cell_size': '0.5',
            'rewards': '{step: -1, goal: 1}', 'nav2': write_map(tmp_path), key: value}
    with pytest.raises(MapError) as error:
        parse_map('\n'.join(f'{each}: {text}' for each, text in keys.items()), 'report')
    assert str(error.value) == message
