# SPDX-License-Identifier: Apache-2.0
"""Maps of Nav2's map_server: a YAML file and an image, read as cells of a chosen size."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from comply_ros.storage.cell_rules_yaml import read_real
from comply_ros.storage.file_system import path_errors, PathError
from comply_ros.storage.text_and_yaml_files import load_yaml, read_text, shown, YamlError
from comply_ros.world.grid import FREE, GOAL, LARGEST_SIDE, MapError, OBSTACLE

KEYS = ('image', 'resolution', 'origin', 'occupied_thresh', 'free_thresh', 'negate')
MODES = ('trinary', 'scale', 'raw')
UNKNOWN, CLEAR, OCCUPIED = -1, 0, 100  # of an occupancy grid, in percent
MOST_PIXELS = 64_000_000
LARGEST_COORDINATE = 1e6  # metres

Point = tuple[float, float]
Gray = NDArray[np.float64]  # [row, column], from the top; 0 black, 1 white


class Nav2Map(NamedTuple):
    """
    What map_server publishes.

    occupancy: int8 `[y, x]`, from the lower left: 0 free, 100 occupied, -1 unknown. resolution:
    metres of a pixel. origin: (x, y, yaw) of the lower left corner, in metres and radians.
    """

    occupancy: NDArray[np.int8]
    resolution: float
    origin: tuple[float, float, float]


class _Header(NamedTuple):
    """The keys of the YAML file of a map."""

    image: str
    resolution: float
    origin: tuple[float, float, float]
    occupied_thresh: float
    free_thresh: float
    negate: bool
    mode: str


def read_nav2_map(name: str, folder: Path = Path()) -> Nav2Map:
    """
    Return the map of a YAML file in the format of Nav2's map_server.

    name: path of the file, from the folder.

    Raises
    ------
    MapError: naming what is wrong with the file or its image.

    """
    try:
        with path_errors():
            path = folder / Path(name).expanduser()
        header = _header(load_yaml(read_text(path)).value)
    except PathError as error:
        raise MapError('a map of Nav2 must be a readable YAML file, which names its image '
                       f'({error})') from None
    except YamlError as error:
        raise MapError(f'{error.about("a map of Nav2")} in line {error.line}') from None
    image = path.parent / header.image
    gray, mean, opaque = _read_image(image)
    occupancy = _occupancy(header, gray, mean, opaque)
    return Nav2Map(occupancy[::-1].copy(), header.resolution, header.origin)


def nav2_rows(nav2: Nav2Map, cell_size: float, goals: Sequence[Point]) -> list[str]:
    """
    Return the rows of a map, top row first: `.` free, `#` obstacle, `G` goal.

    A cell is free if no pixel of it is occupied (100) or unknown, as Nav2's static layer sees it.

    Parameters
    ----------
    nav2: the map.
    cell_size: side of a cell in metres, a multiple of the resolution.
    goals: (x, y) of every goal, in metres.

    Raises
    ------
    MapError: for a wrong cell size, and for a goal that is not in a free cell.

    """
    free = _free_cells(nav2, cell_size)
    cells = np.where(free, FREE, OBSTACLE)
    for goal in goals:
        s = nav2_state(nav2, cell_size, goal, 'goal')
        cells[divmod(s, cells.shape[1])] = GOAL
    return [''.join(row) for row in cells[::-1]]


def nav2_state(nav2: Nav2Map, cell_size: float, point: Point, name: str) -> int:
    """
    State of the free cell with a point.

    Parameters
    ----------
    nav2, cell_size: as in `nav2_rows`.
    point: (x, y) in metres. name: of the point, for messages.

    Raises
    ------
    MapError: if the point is not on the map, or not in a free cell.

    """
    free = _free_cells(nav2, cell_size)
    height, width = free.shape
    x0, y0, yaw = nav2.origin
    dx, dy = point[0] - x0, point[1] - y0
    x = int(np.floor((np.cos(yaw) * dx + np.sin(yaw) * dy) / cell_size))
    y = int(np.floor((np.cos(yaw) * dy - np.sin(yaw) * dx) / cell_size))
    if not (0 <= x < width and 0 <= y < height):
        raise MapError(f'a {name} must lie on the map of {width * cell_size:g} x '
                       f'{height * cell_size:g} metres at ({x0:g}, {y0:g}), '
                       f'got ({point[0]:g}, {point[1]:g})')
    if not free[y, x]:
        raise MapError(f'a {name} must lie in a free cell, but in that of ({point[0]:g}, '
                       f'{point[1]:g}) something is occupied or unknown')
    return y * width + x


def read_points(points: Any, name: str) -> list[Point]:
    """
    Return a list of [x, y] in metres.

    Raises
    ------
    MapError: if it is something else.

    """
    rule = f'{name} must be a list of [x, y] in metres, got {shown(points)}'
    if not isinstance(points, list) or not points:
        raise MapError(rule)
    for point in points:
        if not (isinstance(point, list | tuple) and len(point) == 2
                and all(type(number) in (int, float) for number in point)
                and all(abs(number) <= LARGEST_COORDINATE for number in point)):
            raise MapError(rule)
    return [(float(x), float(y)) for x, y in points]


def _header(table: Any) -> _Header:
    if not isinstance(table, dict):
        raise MapError(f'a map of Nav2 must be a table of {", ".join(KEYS)}, '
                       f'got {type(table).__name__}')
    for key in KEYS:
        if key not in table:
            raise MapError(f'a map of Nav2 needs the key {key!r}')
    image, negate, mode = table['image'], table['negate'], table.get('mode', MODES[0])
    if not isinstance(image, str) or not image:
        raise MapError(f'image must be the name of a file, got {shown(image)}')
    if type(negate) not in (int, bool) or negate not in (0, 1):
        raise MapError(f'negate must be 0 or 1, got {shown(negate)}')
    if mode not in MODES:
        raise MapError(f'mode must be one of {", ".join(MODES)}, got {shown(mode)}')
    resolution = read_real(table['resolution'], 'resolution')
    if not 0 < resolution <= LARGEST_COORDINATE:
        raise MapError('resolution must lie above 0 and be at most 1000000 metres, '
                       f'got {resolution}')
    free, occupied = (read_real(table[key], key) for key in ('free_thresh', 'occupied_thresh'))
    if not 0 <= free < occupied <= 1:
        raise MapError('the thresholds must be 0 <= free_thresh < occupied_thresh <= 1, '
                       f'got {free} and {occupied}')
    return _Header(image, resolution, _origin(table['origin']), occupied, free, bool(negate), mode)


def _origin(origin: Any) -> tuple[float, float, float]:
    if not (isinstance(origin, list) and len(origin) == 3
            and all(type(number) in (int, float) for number in origin)
            and all(abs(number) <= LARGEST_COORDINATE for number in origin)):
        raise MapError(f'origin must be [x, y, yaw], in metres and radians, got {shown(origin)}')
    return float(origin[0]), float(origin[1]), float(origin[2])


def _read_image(path: Path) -> tuple[Gray, Gray, NDArray[np.bool_]]:
    """Return brightness, brightness with opacity as one channel more, and what is opaque."""
    from PIL import Image, UnidentifiedImageError  # here, since only these maps need it
    try:
        with path_errors():
            file = path.open('rb')
        with file, Image.open(file, formats=('PPM', 'PNG')) as image:
            if image.width * image.height > MOST_PIXELS:
                raise MapError(f'image {path.name!r} may have at most {MOST_PIXELS} pixels, '
                               f'got {image.width} x {image.height}')
            return _channels(image)
    except PathError as error:
        reason = str(error)
    except UnidentifiedImageError:
        reason = 'it is of another format'
    except MapError:
        raise
    except (OSError, ValueError, SyntaxError, EOFError):  # as Pillow finds it
        reason = 'it is cut off or damaged'
    except Image.DecompressionBombError:
        reason = 'it has too many pixels'
    raise MapError(f'image {path.name!r} must be a PGM or PNG file ({reason})')


def _channels(image: Any) -> tuple[Gray, Gray, NDArray[np.bool_]]:
    if image.mode.startswith('I'):  # 16 bits
        gray = np.asarray(image, dtype=float) / 65535
        return gray, gray, np.ones(gray.shape, dtype=bool)
    has_alpha = 'A' in image.mode or 'transparency' in image.info
    pixels = np.asarray(image.convert('RGBA' if has_alpha else 'RGB'), dtype=float) / 255
    gray = pixels[..., :3].mean(axis=-1)
    opaque = pixels[..., 3] == 1.0 if has_alpha else np.ones(gray.shape, dtype=bool)
    return gray, pixels.mean(axis=-1), opaque


def _occupancy(header: _Header, gray: Gray, mean: Gray,
               opaque: NDArray[np.bool_]) -> NDArray[np.int8]:
    """Return the occupancy of every pixel, as map_server computes it; the top row first."""
    if header.mode == 'raw':
        level = np.floor(gray * 255 + 0.5)
        return np.where(level <= OCCUPIED, level, UNKNOWN).astype(np.int8)
    shade = mean if header.mode == 'trinary' else gray
    occupied = shade if header.negate else 1.0 - shade
    between = np.full(shade.shape, float(UNKNOWN))
    if header.mode == 'scale':
        span = header.occupied_thresh - header.free_thresh
        between = np.rint((occupied - header.free_thresh) / span * OCCUPIED)
    found = np.where(occupied > header.occupied_thresh, OCCUPIED,
                     np.where(occupied < header.free_thresh, CLEAR, between))
    if header.mode == 'scale':
        found = np.where(opaque, found, UNKNOWN)
    return found.astype(np.int8)


def _free_cells(nav2: Nav2Map, cell_size: float) -> NDArray[np.bool_]:
    """`free[y, x]` of the cells; a cell that the image fills in part only is not free."""
    pixels = round(cell_size / nav2.resolution) if np.isfinite(cell_size) else 0
    if pixels < 1 or abs(pixels * nav2.resolution - cell_size) > 1e-6 * cell_size:
        raise MapError(f'cell_size must be a multiple of the resolution of {nav2.resolution:g} '
                       f'metres, got {cell_size:g}')
    clear = (nav2.occupancy != UNKNOWN) & (nav2.occupancy < OCCUPIED)
    rows, columns = (-(-side // pixels) for side in clear.shape)
    if max(rows, columns) > LARGEST_SIDE:
        raise MapError(f'a map may have at most {LARGEST_SIDE} cells a side, '
                       f'got {columns} x {rows}: choose a larger cell_size')
    whole = np.zeros((rows * pixels, columns * pixels), dtype=bool)
    whole[:clear.shape[0], :clear.shape[1]] = clear
    return whole.reshape(rows, pixels, columns, pixels).all(axis=(1, 3))
