# SPDX-License-Identifier: Apache-2.0
"""What a node keeps in its `state_dir`, before it says what follows from it."""

from comply_ros.storage.state_store import StateStore


class Checkpointing:
    """
    Keeps what an actor was told; without a folder it keeps nothing, and all is well.

    Parameters
    ----------
    node: the rclpy node, for its name and its log.
    folder: the `state_dir`, empty for none.

    Attributes
    ----------
    keeper: the `StateStore`, None where nothing is kept.
    trouble: words for why it cannot keep what it has to, None while it can.

    """

    def __init__(self, node, folder):
        self._node, self._folder = node, folder
        self.keeper, self.trouble = None, None

    def recall(self, identity, kinds):
        """
        Return what was kept, None where nothing was; from now on it is kept.

        Raises
        ------
        StateError: if it cannot be gone on from.

        """
        self.close()
        if not self._folder:
            return None
        name = self._node.get_fully_qualified_name().strip('/').replace('/', '.')
        self.keeper = StateStore(self._folder, name, identity, kinds)
        return self.keeper.load()

    def keep(self, actor):
        """Return whether what the actor was told is kept now; a new snapshot is made if due."""
        try:
            self._keep(actor)
        except OSError as error:
            self._tell(error)
            return False
        if self.trouble:
            self._node.get_logger().info('state_dir can be written again: goes on')
            self.trouble = None
        if self.keeper and self.keeper.is_checkpoint_due():
            self._renew(actor)
        return True

    def look(self, actor):
        """Return whether all is kept; where somebody took the folder away, in a new one."""
        if self.keeper is None or not self.keeper.was_removed():
            return True
        self._node.get_logger().warning(
            f'state_dir {self._folder!r} was taken away: it is made anew')
        actor.needs_checkpoint = True
        return self.keep(actor)

    def close(self):
        """Close what is kept."""
        if self.keeper:
            self.keeper.close()

    def _keep(self, actor):
        """Keep what the actor was told; raises OSError, and the next call does what is left."""
        try:
            if self.keeper is None:
                return
            if actor.needs_checkpoint or self.keeper.sync_error:
                self.keeper.write_checkpoint(*actor.state_dict())
                actor.needs_checkpoint = False
            else:
                self.keeper.append(actor.journal_entries)
        finally:
            actor.journal_entries.clear()  # the state has it, or the keeper

    def _renew(self, actor):
        """Write a new snapshot; where that cannot be, the journal goes on."""
        try:
            self.keeper.write_checkpoint(*actor.state_dict())
        except OSError as error:
            self.keeper.postpone_checkpoint()
            self._node.get_logger().warning(f'no new snapshot in state_dir {self._folder!r} '
                                            f'({error.strerror.lower()}): the journal goes on')

    def _tell(self, error):
        """Say, once, that nothing more can be kept."""
        if self.trouble is None:
            self.trouble = (f'pauses: state_dir {self._folder!r} cannot be written '
                            f'({error.strerror.lower()})')
            self._node.get_logger().error(f'{self.trouble}; goes on when it can')
