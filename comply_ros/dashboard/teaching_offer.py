# SPDX-License-Identifier: Apache-2.0
"""What the page says about the person as a mentor beside others, and the name of that mentor."""

from collections.abc import Sequence
from typing import NamedTuple

from comply_ros.dashboard.dashboard_node import PageState
from comply_ros.dashboard.node_discovery import LEARNER
from comply_ros.mentor.several_mentors import free_name, MOST_MENTORS, PERSON
from comply_ros.nodes.parameters import ADVICE_TIMEOUT, MENTORS, timeout_of
from comply_ros.protocol.advice_timeouts import NO_LIMIT

SHORT_WAIT = 1.0  # seconds that a learner waits at least for a mentor that it found while it ran


class Offer(NamedTuple):
    """
    What a person who watches reads.

    Attributes
    ----------
    text: a sentence.
    button: its label; '' for none.
    hint: what the button does.

    """

    text: str
    button: str = ''
    hint: str = ''


def person_name(given: str, others: Sequence[str], mentors: Sequence[str]) -> str:
    """
    Return the name of the person as a mentor; '' for the only one, without a name.

    Parameters
    ----------
    given: the parameter `name`, which wins.
    others: names under which other mentors publish.
    mentors: names of those that the learner has.

    """
    if given or not any((*others, *mentors)):
        return given
    return free_name(PERSON, others)


def learner_mentors(state: PageState) -> tuple[str, ...]:
    """Return the names of the mentors that the learner has; none before it has told them."""
    learner = state.run.reports.learner
    return tuple(learner.mentors) if learner else ()  # a message has a list


def teaching_offer(state: PageState, given: str) -> Offer | None:
    """
    Return what the page says to a person who watches; None where there is no other mentor.

    given: as `person_name` takes it.
    """
    others, mentors = state.mentor_names if state.other_mentors else (), learner_mentors(state)
    name = person_name(given, others, mentors)
    nobody_is_here = not others and not any(mentors)
    is_waited_for = name in mentors and name not in others
    if nobody_is_here or is_waited_for:
        return None  # the page teaches in a moment
    reason = why_no_advice(state, name)
    if reason:
        return Offer(f'You watch: {reason}.')
    if name in others:
        heard = f'Another mentor has the name {name}' if name else 'Another mentor is heard'
        return Offer(f'{heard}, and you watch.', 'Take over', 'be a mentor too; end the other '
                     'one, or the learner uses the advice of both')
    return Offer(f'{_count_text(len(others))}, and you watch.', 'Teach too' if others else 'Teach',
                 f'be the mentor {name} too, from the beginning of the next episode on')


def joining_text(state: PageState, name: str) -> str:
    """Sentence on why the learner does not take the advice of the person now; '' if it does."""
    reason = why_no_advice(state, name)
    if reason:
        return f'Your advice has no effect: {reason}.'
    mentors = learner_mentors(state)
    return '' if not mentors or name in mentors else \
        'The learner takes your advice from the beginning of its next episode on.'


def why_no_advice(state: PageState, name: str) -> str:
    """Return why the learner never takes the advice of a mentor of this name; '' if it does."""
    settings, mentors = state.parameters.get(LEARNER, {}), learner_mentors(state)
    for parameter, value in (('learns', False), ('trust', 'none')):
        if parameter in settings and settings[parameter].value == value:
            shown = str(value).lower()
            return f'the learner takes no advice, since its parameter {parameter} is {shown}'
    if len(mentors) >= MOST_MENTORS and name not in mentors:
        return f'the learner has {len(mentors)} mentors, the most that it takes'
    return ''


def patience_text(state: PageState, name: str, patience: float) -> str:
    """
    Sentence on how long an observation waits for a key: the learner may wait less than `patience`.

    patience: of the mentor, in seconds.
    """
    settings = state.parameters.get(LEARNER, {})
    own, of_all = (settings[each].value if each in settings else NO_LIMIT
                   for each in (timeout_of(name).name, ADVICE_TIMEOUT.name))
    is_expected = MENTORS.name not in settings or name in settings[MENTORS.name].value
    limit = min([patience, *(each for each in [own or of_all] if each != NO_LIMIT)])
    if own != NO_LIMIT or is_expected or limit <= SHORT_WAIT:
        return f'the robot waits {limit:g} s for a key'
    return (f'the robot waits 1 to 2 s for a key, not {patience:g} s, then goes on until the next '
            'key')


def _count_text(count: int) -> str:
    return f'{count} mentors advise' if count > 1 else 'Another mentor advises' if count else \
        'No mentor advises'
