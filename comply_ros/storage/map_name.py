# SPDX-License-Identifier: Apache-2.0
"""Names of maps: one of the package, a file, or `nav2:`, `gym:` or `garnet:` and what follows."""

from importlib.resources import files
from pathlib import Path
import re
from typing import Any, NamedTuple
from urllib.parse import unquote

from comply_ros.storage.file_system import absolute_path
from comply_ros.storage.text_and_yaml_files import load_yaml, shown, YamlError
from comply_ros.world.grid import MapError

NAV2, GYM, GARNET = SCHEMES = 'nav2', 'gym', 'garnet'
LONGEST_TITLE, LONGEST_STEM = 255, 100  # characters
OTHER_MAPS = ('a map file, gym:NAME of Gymnasium, nav2:FILE?start=X,Y&goal=X,Y, or garnet:SEED, '
              'a random world')  # for helps


class MapName(NamedTuple):
    """
    What a name of a map such as `gym:FrozenLake-v1?map_name=8x8&is_slippery=false` says.

    scheme: `nav2`, `gym`, `garnet`, or '' for a map of the package and for a map file.
    target: the path, the name of the map or environment, or the seed.
    arguments: by their names; always empty without a scheme.
    """

    scheme: str
    target: str
    arguments: dict[str, Any]


def map_names() -> list[str]:
    """Names of the maps that come with the package."""
    found = (Path(entry.name) for entry in files('comply_ros').joinpath('maps').iterdir())
    return sorted(entry.stem for entry in found if entry.suffix == '.yaml')


def parse_map_name(name: str) -> MapName:
    """
    Return the parts of a name; in one with a scheme, `%XX` is read as in an address.

    Values of arguments are read as YAML.

    Raises
    ------
    MapError: naming the argument that is wrong.

    """
    scheme, colon, rest = name.partition(':')
    if not colon or scheme not in SCHEMES:
        return MapName('', name, {})
    target, _, text = rest.partition('?')
    arguments: dict[str, Any] = {}
    for word in text.split('&') if text else ():
        key, equals, value = word.partition('=')
        if not key.isidentifier() or not equals:
            raise MapError("an argument behind '?' must be NAME=VALUE, with '&' between two, got "
                           + shown(word))
        if key in arguments:
            raise MapError(f'an argument must be there once, got {key!r} again')
        try:
            arguments[key] = load_yaml(_unquoted(value)).value
        except YamlError as error:
            raise MapError(f'argument {key}: {error.about("its value")}') from None
    return MapName(scheme, _unquoted(target), arguments)


def _unquoted(text: str) -> str:
    """Return a text with `%XX` read; raises MapError unless that is UTF-8."""
    try:
        return unquote(text, errors='strict')
    except UnicodeDecodeError:
        raise MapError(f'%XX must be bytes of UTF-8, got {shown(text)}') from None


def map_title(name: str) -> str:
    """Return a map's name as people read it: a file without its folder and its ending."""
    scheme, colon, rest = name.partition(':')
    if colon and scheme in (GYM, GARNET):
        return name[:LONGEST_TITLE]
    return Path(unquote(rest.partition('?')[0]) if colon and scheme == NAV2 else name).stem


def file_stem(name: str) -> str:
    """Return how the name of a file about a map begins, without letters that files lack."""
    title = map_title(name)
    is_no_path = name.startswith((f'{GYM}:', f'{GARNET}:'))
    return re.sub(r'[^\w.-]+', '_', title)[:LONGEST_STEM] if is_no_path else title


def is_path(name: str) -> bool:
    """Whether the name is the path of a map file."""
    return name not in map_names() and not name.startswith(tuple(f'{each}:' for each in SCHEMES))


def absolute_name(name: str) -> str:
    """Return a name that means the same map in any folder."""
    scheme, colon, rest = name.partition(':')
    if scheme == NAV2 and colon:
        path, question, arguments = rest.partition('?')
        path = absolute_path(unquote(path)).replace('%', '%25').replace('?', '%3F')
        return f'{NAV2}:{path}{question}{arguments}'
    return absolute_path(name) if is_path(name) else name
