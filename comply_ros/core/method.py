# SPDX-License-Identifier: Apache-2.0
"""A learner is one row of numbers: its fields, their ranges, and the table of all rows."""

from collections import namedtuple
from dataclasses import dataclass, field, fields, replace
from math import isfinite, log

TRUSTS = ('none', 'scheduled', 'beta', 'explicit')
NO_TRUST, SCHEDULED, BETA, EXPLICIT = range(4)

TINY = 1e-9  # the softmax needs a temperature above 0
ANY = 1_000_000  # a bound for what needs none


class MethodError(ValueError):
    """A method, field or value that does not exist; the message names the rule and the value."""


def _field(default, text, low=None, high=None, **metadata):
    return field(default=default, metadata={'text': text, 'low': low, 'high': high, **metadata})


@dataclass(frozen=True)
class Method:
    """
    One learner: how it updates, how it explores, whom it trusts.

    Every field is a parameter of the learner node and a FIELD of `--set FIELD=VALUE`; its range
    and meaning stand in the field's metadata.

    Raises
    ------
    MethodError: for a value of the wrong type or out of its range.

    """

    off_policy: bool = _field(
        False, 'Learn towards the best next action (2.17), not towards the chosen one (2.15)')
    discount: float = _field(1.0, 'Discount factor gamma of (2.2)', 0, 1)
    initial_value: float = _field(0.0, 'Action value of what was never tried', -ANY, ANY)
    learning_rate: float = _field(1.0, 'First learning rate of (2.26)', 0, 1)
    learning_rate_exponent: float = _field(
        1.0, 'The learning rate falls with the visits c as 1 / c^exponent (2.26)', 0, 2)
    visit_growth: float = _field(
        1.0, 'How much each visit of a state and action adds to its c, which starts at 1', 0, 1)
    temperature: float = _field(1.0, 'First temperature of the softmax (2.24)', TINY, ANY)
    temperature_factor: float = _field(
        0.99, 'Factor on the temperature after each iteration (2.25)', 0, 1)
    temperature_floor: float = _field(TINY, 'The temperature never falls below this', TINY, ANY)
    cooling_confidence: float = _field(
        1.0, 'The temperature falls only while the confidence p is at or below this', 0, 1)
    trust: str = _field(
        'none', 'Whom to trust: nobody, the mentor by a schedule (3.6), by a Beta belief (3.7), '
        'or by the values of listening and discarding (3.11)', choices=TRUSTS)
    excludes_refused: bool = _field(
        False, 'A refused recommendation is left out of the own choice (3.2)')
    confidence: float = _field(0.9, 'First confidence p of scheduled trust (3.2)', 0, 1)
    confidence_factor: float = _field(1.0, 'Factor on p after each iteration (3.6)', 0, 1)
    belief_listen: float = _field(
        8.0, 'First alpha of the Beta belief, or first value of listening (3.13)', -ANY, ANY)
    belief_discard: float = _field(
        2.0, 'First beta of the Beta belief, or first value of discarding', -ANY, ANY)
    trust_rate: float = _field(
        1.0, 'Rate of the Beta belief, gamma of (4.2), or weight of the new value, 1 - beta '
        'of (3.12)', 0, 1000)
    sign_only: bool = _field(False, 'The Beta belief learns from the sign of delta alone')
    bounded_belief: bool = _field(False, 'alpha and beta of the Beta belief are cut at 0')
    updates_both: bool = _field(
        True, 'Explicit trust updates listening and discarding at every step (3.12), not only '
        'what was done')
    listen_temperature: float = _field(
        0.5, 'First temperature of the choice between listening and discarding (3.11)', TINY, ANY)
    listen_temperature_exponent: float = _field(
        0.55, 'That temperature falls with the visits n of the state as 1 / n^exponent', 0, 2)
    measuring_iterations: int = _field(
        0, 'So many iterations at the beginning only measure and do not learn', 0, 1_000_000)
    iterations: int = _field(
        400, 'Iterations to learn for, then rest (0: without end)', 0, 1_000_000_000)
    episodes: int = _field(15, 'Episodes per iteration', 1, 1_000_000)

    def __post_init__(self):
        for row in fields(self):
            _check(row, getattr(self, row.name))
        if self.trust == 'explicit' and self.trust_rate > 1:
            raise MethodError('trust_rate must lie in [0, 1] where trust is explicit, '
                              f'got {self.trust_rate}')
        if self.trust == 'beta' and min(self.belief_listen, self.belief_discard) <= 0:
            raise MethodError('belief_listen and belief_discard must be above 0 where trust is '
                              f'beta, got {self.belief_listen} and {self.belief_discard}')

    def numbers(self):
        """Return the fields as `Numbers`, which compiled code takes: `trust` by its index."""
        values = {row.name: getattr(self, row.name) for row in fields(self)}
        return Numbers(**{**values, 'trust': TRUSTS.index(self.trust)})

    def needs_mentor(self):
        """Tell whether a decision waits for a recommendation."""
        return self.trust != 'none'


Numbers = namedtuple('Numbers', [row.name for row in fields(Method)])
FIELDS = {row.name: row for row in fields(Method)}


def _check(row, value):
    if type(value) is not row.type:
        raise MethodError(f'{row.name} must be {_kind(row.type)}, got {value!r}')
    choices, low, high = (row.metadata.get(key) for key in ('choices', 'low', 'high'))
    if choices and value not in choices:
        raise MethodError(f'{row.name} must be one of {", ".join(choices)}, got {value!r}')
    if low is not None and not (isfinite(value) and low <= value <= high):
        raise MethodError(f'{row.name} must lie in [{low}, {high}], got {value}')


def _kind(kind):
    return {bool: 'true or false', int: 'a whole number', float: 'a number such as 1.0',
            str: 'a word'}[kind]


def with_text(method, name, text):
    """
    Return the method with one field read from text, as in `--set NAME=TEXT`.

    Raises
    ------
    MethodError: for an unknown field, a text of the wrong type, a value out of its range.

    """
    if name not in FIELDS:
        raise MethodError(f'a method has no field {name!r}; it has {", ".join(FIELDS)}')
    kind = FIELDS[name].type
    words = {'true': True, 'false': False}
    try:
        value = words[text.lower()] if kind is bool else kind(text)
    except (KeyError, ValueError):
        raise MethodError(f'{name} must be {_kind(kind)}, got {text!r}') from None
    return replace(method, **{name: value})


def find_method(name, profile):
    """
    Row of a method in a profile.

    Raises
    ------
    MethodError: for an unknown name or profile.

    """
    if profile not in METHODS:
        raise MethodError(f'a profile must be one of {", ".join(METHODS)}, got {profile!r}')
    if name not in METHODS[profile]:
        raise MethodError(f'a method must be one of {", ".join(METHODS[profile])}, got {name!r}')
    return METHODS[profile][name]


def listening_lead(p, temperature):
    """First value of listening over discarding that makes p the confidence (3.13)."""
    return temperature * log(p / (1.0 - p))


def _published(**settings):
    return Method(temperature_floor=0.03, measuring_iterations=1, **settings)


def _as_the_text_says(row, **settings):
    return replace(row, learning_rate_exponent=0.55, visit_growth=1.0, temperature_floor=TINY,
                   measuring_iterations=0, **settings)


PUBLISHED = {
    'sarsa': _published(
        initial_value=3.0, visit_growth=1 / 15, temperature=4.0, iterations=600),
    'q_learning': _published(
        off_policy=True, initial_value=1.0, learning_rate=0.8, learning_rate_exponent=0.505,
        temperature_factor=0.98, iterations=600, episodes=10),
    'constant': _published(
        trust='scheduled', learning_rate_exponent=0.51, temperature=0.5, temperature_factor=0.98),
    'vanishing': _published(
        trust='scheduled', learning_rate_exponent=0.51, temperature=0.5, temperature_factor=0.98,
        confidence_factor=0.99, cooling_confidence=0.5),
    'beta_implicit': _published(
        trust='beta', excludes_refused=True, visit_growth=1 / 15, trust_rate=2.0,
        sign_only=True, bounded_belief=True),
    'explicit': _published(
        trust='explicit', excludes_refused=True, learning_rate_exponent=0.55, visit_growth=1 / 15,
        temperature=2.0, trust_rate=0.1, belief_listen=1.095, belief_discard=0.0,
        updates_both=False),
}

REPORT = {
    'sarsa': _as_the_text_says(PUBLISHED['sarsa']),
    'q_learning': _as_the_text_says(PUBLISHED['q_learning']),
    'constant': _as_the_text_says(PUBLISHED['constant']),
    'vanishing': _as_the_text_says(PUBLISHED['vanishing'], cooling_confidence=1.0),
    'beta_implicit': _as_the_text_says(
        PUBLISHED['beta_implicit'], sign_only=False, bounded_belief=False,
        trust_rate=0.3),  # of the order of the prior (section 4.1.1): larger ones run away
    'explicit': _as_the_text_says(
        PUBLISHED['explicit'], updates_both=True, belief_listen=listening_lead(0.9, 0.5)),
}

METHODS = {'report': REPORT, 'published': PUBLISHED}
