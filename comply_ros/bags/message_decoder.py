# SPDX-License-Identifier: Apache-2.0
"""What was said between world, mentor and learner, out of the bytes of a bag."""

from rosbags.typesys import get_types_from_msg, get_typestore, Stores

from comply_ros.bags.bag_message import BagError, in_short
from comply_ros.protocol.messages import TOPIC_TYPES


class DecodedMessages:
    """
    What was said in one namespace, as tuples of `dialogue`, in the order of the bag.

    Parameters
    ----------
    bag: the `Bag`.
    namespace: of the nodes; None: the only one that there is.

    Attributes
    ----------
    bag: as given.
    namespace: as given or found, as in `/second`; the root is an empty text.

    Raises
    ------
    BagError: if the bag has no conversation, or several and no namespace was given.

    """

    def __init__(self, bag, namespace=None):
        self.bag = bag
        self.namespace = _namespace_of(bag, namespace)
        self._decoders = {}

    def __iter__(self):
        """Yield (topic, tuple) of all that was said; raises BagError for what cannot be read."""
        start = self.namespace + '/'
        names = {start + name: name for name in TOPIC_TYPES}
        for number, recorded in enumerate(self.bag):
            name = names.get(recorded.topic)
            if name and recorded.kind == kind_of(name):
                yield name, self._decode(name, recorded, number)

    def _decode(self, name, recorded, number):
        if name not in self._decoders:
            self._decoders[name] = _decoder(name, recorded)
        try:
            return self._decoders[name](recorded.content)
        except Exception as error:  # noqa: BLE001 - whatever nonsense in bytes makes it raise
            raise BagError(f'message {number} of the bag, on topic {recorded.topic}, must be a '
                           f'{recorded.kind}, and is not ({in_short(error)})') from None


def kind_of(name):
    """Type of the messages on a topic of ours."""
    return f'comply_msgs/msg/{TOPIC_TYPES[name].__name__}'


def _namespace_of(bag, given):
    """Return the namespace of the conversation in a bag."""
    spaces = set()
    for recorded in bag:
        space, _, name = recorded.topic.rpartition('/')
        if name == 'world' and recorded.kind == kind_of('world'):
            spaces.add(space)
    wanted = None if given is None else '/' + given.strip('/') if given.strip('/') else ''
    where = f'in namespace {wanted}' if wanted else ''
    if wanted is not None and wanted not in spaces or not spaces:
        raise BagError(f'bag {str(bag.path)!r} must have a world {where}'.rstrip()
                       + f', and has none among its {bag.count} messages'
                       + (f' ({bag.cut})' if bag.cut else '')
                       + (f': its namespaces are {_names(spaces)}' if spaces else ''))
    if wanted is None and len(spaces) > 1:
        raise BagError(f'bag {str(bag.path)!r} has several conversations: name one of the '
                       f'namespaces {_names(spaces)} with --namespace')
    return min(spaces) if wanted is None else wanted


def _names(spaces):
    return ', '.join(space or '/' for space in sorted(spaces))


def _decoder(name, recorded):
    """Return a function from bytes to a tuple; raises BagError for what is of another version."""
    msg, (encoding, text) = TOPIC_TYPES[name], recorded.definition
    if encoding != 'ros2msg':
        raise BagError(f'topic {recorded.topic} must come with its definition as ros2msg, '
                       f'got {encoding or "none"!r}')
    store = get_typestore(Stores.EMPTY)
    try:
        store.register(get_types_from_msg(text, recorded.kind))
        fields = [field for field, _ in store.fielddefs[recorded.kind][1]]
    except Exception as error:  # noqa: BLE001 - whatever nonsense in a text makes it raise
        raise BagError(f'the definition of {recorded.kind} in the bag must be one of a message '
                       f'({in_short(error)})') from None
    missing = [field for field in msg._fields if field not in fields]
    if missing:
        raise BagError(f'{recorded.kind} must have the fields of this version, and the bag has '
                       f'it without {", ".join(missing)}')
    decode = store.deserialize_cdr

    def to_tuple(content):
        message = decode(content, recorded.kind)
        return msg(*[_plain(getattr(message, field)) for field in msg._fields])
    return to_tuple


def _plain(value):
    return value.tolist() if hasattr(value, 'tolist') else value
