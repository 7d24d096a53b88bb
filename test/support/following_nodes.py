# SPDX-License-Identifier: Apache-2.0
"""Parts of a mentor or a learner that follow the wrong world, by the rule that they break."""

from comply_ros.protocol.messages import PROTOCOL


class AnyProtocol:
    """Follows a world of another protocol."""

    def on_world(self, msg):
        return super().on_world(msg._replace(protocol=PROTOCOL))


class Forgetful:
    """Drops an observation whose world is not known yet."""

    def observe(self, msg):
        tracker = self.tracker
        known = msg.run == tracker.run or msg.run in tracker._rivals
        return super().observe(msg) if known else ()


class Fickle:
    """Follows each world that it receives at once."""

    def on_world(self, msg):
        return super().on_world(msg._replace(replaces=self.tracker.run or 0))


class Loyal:
    """Does not follow a reset."""

    def on_world(self, msg):
        return super().on_world(msg._replace(replaces=0))


class Stubborn:
    """Follows no other world, however long its own is silent."""

    def tick(self):
        return ()


FOLLOWING = {'P5': AnyProtocol, 'P7': Forgetful, 'P8': Fickle, 'P9': Loyal, 'P10': Stubborn}
