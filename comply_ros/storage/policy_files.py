# SPDX-License-Identifier: Apache-2.0
"""Policies as text files."""

from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from comply_ros.mentor.policy_text import format_policy, parse_policy
from comply_ros.mentor.policy_validation import PolicyError
from comply_ros.storage.file_system import atomic_write, path_errors, PathError
from comply_ros.storage.text_and_yaml_files import read_text
from comply_ros.world.mdp import World


def read_policy(path: str | Path, world: World) -> NDArray[Any]:
    """
    `policy[s]` of a policy file; -1 for no advice.

    Raises
    ------
    PolicyError: if it cannot be read, or does not fit the world.

    """
    try:
        return parse_policy(read_text(path), world)
    except PathError as error:
        raise PolicyError(f'a policy file must be readable, got {str(path)!r} '
                          f'({error})') from None


def write_policy(path: str | Path, policy: NDArray[Any], world: World) -> None:
    """
    Write a policy file as a whole.

    Raises
    ------
    PolicyError: if it cannot be written; the file is as before.

    """
    try:
        with path_errors():
            file = Path(path).expanduser()
            is_other = file.exists() and not file.is_file()
            if not is_other:
                with atomic_write(file) as part:
                    part.write_text(format_policy(policy, world))
    except PathError as error:
        raise PolicyError(f'a policy file must be one that can be written, got {str(path)!r} '
                          f'({error})') from None
    if is_other:
        raise PolicyError(f'a policy must be written to a file, got {str(path)!r}')
