# SPDX-License-Identifier: Apache-2.0
"""The state of a node in its `state_dir`, written before it publishes what follows from it."""

from collections.abc import Mapping, Sequence
from typing import Any

from rclpy.node import Node

from comply_ros.storage.state_store import StateStore


class Checkpointing:
    """
    Writes what an actor received to disk; without a folder it writes nothing, and all is well.

    folder: the `state_dir`, empty for none.
    """

    def __init__(self, node: Node, folder: str) -> None:
        self._node, self._folder = node, folder
        self.store: StateStore | None = None
        self.error: str | None = None  # why it cannot write what it has to, in one sentence

    def load(self, identity: Mapping[str, Any], kinds: Sequence[type]) -> Any:
        """
        Return what was stored, None where nothing was; from now on `save` stores more.

        Raises StateError if the node cannot go on from it.
        """
        self.close()
        if not self._folder:
            return None
        name = self._node.get_fully_qualified_name().strip('/').replace('/', '.')
        self.store = StateStore(self._folder, name, identity, kinds)
        return self.store.recall()

    def save(self, actor: Any) -> bool:
        """
        Write what the actor received to the journal, or its whole state to a checkpoint.

        Return whether it is written. If not, call again: the next call writes what is left.
        """
        try:
            if self.store and (actor.begins or self.store.trouble):
                self.store.begin(*actor.state())
                actor.begins = False
            elif self.store:
                self.store.keep(actor.told)
        except OSError as error:
            if self.error is None:
                self.error = (f'pauses: state_dir {self._folder!r} cannot be written '
                              f'({_reason(error)})')
                self._node.get_logger().error(f'{self.error}; goes on when it can')
            return False
        finally:
            actor.told.clear()  # the state has it, or the store
        if self.error:
            self._node.get_logger().info('state_dir can be written again: goes on')
            self.error = None
        if self.store and self.store.is_due():
            try:
                self.store.begin(*actor.state())
            except OSError as error:
                self.store.put_off()
                self._node.get_logger().warning(
                    f'no new checkpoint in state_dir {self._folder!r} ({_reason(error)}): the '
                    'journal goes on')
        return True

    def save_if_removed(self, actor: Any) -> bool:
        """Write the state anew where somebody removed the folder; return whether all is saved."""
        if self.store is None or not self.store.is_lost():
            return True
        self._node.get_logger().warning(
            f'state_dir {self._folder!r} was removed: it is created again')
        actor.begins = True
        return self.save(actor)

    def close(self) -> None:
        """Close the files."""
        if self.store:
            self.store.close()


def _reason(error: OSError) -> str:
    return (error.strerror or str(error)).lower()
