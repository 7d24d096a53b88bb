# SPDX-License-Identifier: Apache-2.0
"""What a person has painted, on disk: a policy file for each map."""

from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from comply_ros.mentor.policy_validation import PolicyError
from comply_ros.storage.checkpoint_store import lock_state_dir
from comply_ros.storage.policy_files import read_policy, write_policy
from comply_ros.world.mdp import World

DIGEST_LENGTH = 12  # hex digits of the map's SHA-256 in the name of a file


class PaintingStore:
    """
    Keeps the policy of a human mentor in `FOLDER/NAME.DIGEST.txt`, a policy file as people write.

    DIGEST: the first digits of the SHA-256 of the map.

    Raises
    ------
    StateError: if the folder cannot be used, or another node uses this name in it.

    """

    def __init__(self, folder: str | Path, name: str) -> None:
        self._name = name
        self._folder, self._lock = lock_state_dir(folder, name)

    def path(self, world: World) -> Path:
        """Path of the file for a world."""
        return self._folder / f'{self._name}.{world.sha256[:DIGEST_LENGTH]}.txt'

    def load(self, world: World) -> NDArray[Any] | None:
        """Return the policy for a world, None where there is none; raises PolicyError."""
        path = self.path(world)
        return read_policy(path, world) if path.exists() else None

    def save(self, policy: NDArray[Any], world: World) -> None:
        """Write the policy for a world; raises PolicyError if that cannot be."""
        try:
            self._lock.renew()  # somebody may have removed the folder
        except OSError as error:
            raise PolicyError(f'a painted policy must be written to {str(self._folder)!r} '
                              f'({str(error.strerror).lower()})') from None
        write_policy(self.path(world), policy, world)

    def close(self) -> None:
        """Give the name free."""
        self._lock.close()
