# SPDX-License-Identifier: Apache-2.0
"""The room of the checks, changes of what a node publishes, and what a check has found."""

from tiny_worlds import grid

from comply_ros.protocol.rule_report import FAIL, NOT_REACHED

ROOM = grid('....G', '.##..', '....#', '.....', starts=(0, 4), limit=30)


def results(verdicts):
    """Return the rules of each result, without those that passed."""
    return {result: [each.rule for each in verdicts if each.result == result]
            for result in (FAIL, NOT_REACHED)}


def unchanged(msg):
    """Return what is published instead of a message: itself."""
    return (msg,)


def only(kind, change):
    """Return a change of the outputs of one kind; it returns the message to publish, or None."""
    def changed(msg):
        if not isinstance(msg, kind):
            return (msg,)
        found = change(msg)
        return (found,) if found is not None else ()
    return changed
