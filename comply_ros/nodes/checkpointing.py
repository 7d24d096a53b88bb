# SPDX-License-Identifier: Apache-2.0
"""The state of a node in its `state_dir`, written before it publishes what follows from it."""

from collections.abc import Mapping, Sequence
from typing import Any

from rclpy.node import Node

from comply_ros.storage.checkpoint_store import CheckpointStore
from comply_ros.storage.file_system import reason_of


class Checkpointing:
    """
    Writes what an machine received to disk; without a folder it writes nothing, and all is well.

    folder: the `state_dir`, empty for none.
    """

    def __init__(self, node: Node, folder: str) -> None:
        self._node, self._folder = node, folder
        self.store: CheckpointStore | None = None
        self.error: str | None = None  # why it cannot write what it has to, in one sentence

    def load(self, identity: Mapping[str, Any], kinds: Sequence[type],
             added: Mapping[str, Any] | None = None) -> Any:
        """
        Return what was stored, None where nothing was; from now on `save` stores more.

        added: as in `CheckpointStore`.

        Raises StateError if the node cannot go on from it.
        """
        self.close()
        if not self._folder:
            return None
        name = self._node.get_fully_qualified_name().strip('/').replace('/', '.')
        self.store = CheckpointStore(self._folder, name, identity, kinds, added or {})
        return self.store.load()

    def save(self, machine: Any) -> bool:
        """
        Write what the machine received to the journal, or its whole state to a checkpoint.

        Return whether it is written. If not, call again: the next call writes what is left.
        """
        if self.store is None:
            machine.journal_entries.clear()
            return True
        try:
            if machine.needs_checkpoint or self.store.sync_error:
                self.store.write_checkpoint(*machine.state_dict())
                machine.needs_checkpoint = False
            else:
                self.store.append(machine.journal_entries)
        except OSError as error:
            if self.error is None:
                self.error = (f'pauses: state_dir {self._folder!r} cannot be written '
                              f'({reason_of(error)})')
                self._node.get_logger().error(f'{self.error}; continues when it can')
            return False
        finally:
            machine.journal_entries.clear()  # the state has it, or the store
        if self.error:
            self._node.get_logger().info('state_dir can be written again: continues')
            self.error = None
        if self.store.is_checkpoint_due():
            try:
                self.store.write_checkpoint(*machine.state_dict())
            except OSError as error:
                self.store.postpone_checkpoint()
                self._node.get_logger().warning(
                    f'no new checkpoint in state_dir {self._folder!r} ({reason_of(error)}): the '
                    'journal goes on')
        return True

    def save_if_removed(self, machine: Any) -> bool:
        """Write the state anew where somebody removed the folder; return whether all is saved."""
        if self.store is None or not self.store.was_removed():
            return True
        self._node.get_logger().warning(
            f'state_dir {self._folder!r} was removed: it is created again')
        machine.needs_checkpoint = True
        return self.save(machine)

    def close(self) -> None:
        """Close the files."""
        if self.store:
            self.store.close()
