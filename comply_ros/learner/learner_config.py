# SPDX-License-Identifier: Apache-2.0
"""A learner is one row of numbers: its fields, and their ranges."""

from collections import namedtuple
from dataclasses import dataclass, field, fields, replace

TRUSTS = ('none', 'scheduled', 'beta', 'explicit', 'shaping', 'jump_start', 'head_start')
NO_TRUST, SCHEDULED, BETA, EXPLICIT, SHAPING, JUMP_START, HEAD_START = range(len(TRUSTS))

TINY = 1e-9  # the softmax needs a temperature above 0
ANY = 1_000_000  # a bound for what needs none


class ConfigError(ValueError):
    """A method, field or value that does not exist; the message names the rule and the value."""


def _field(default, text, low=None, high=None, **metadata):
    return field(default=default, metadata={'text': text, 'low': low, 'high': high, **metadata})


@dataclass(frozen=True)
class LearnerConfig:
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
    replays: bool = _field(
        False, 'Action values come from where each action usually led and what it earned, and are '
        'refreshed backwards at the end of an episode, instead of (2.15) and (2.17)')
    discount: float = _field(1.0, 'Discount factor gamma of (2.2)', 0, 1)
    initial_value: float = _field(0.0, 'Action value of what was never tried', -ANY, ANY)
    learning_rate: float = _field(1.0, 'First learning rate of (2.26)', 0, 1)
    learning_rate_exponent: float = _field(
        1.0, 'The learning rate falls with the visits c as 1 / c^exponent (2.26)', 0, 2)
    visit_growth: float = _field(
        1.0, 'How much each visit of a state and action adds to its c, which starts at 1', 0, 1)
    trace_decay: float = _field(
        0.0, 'Decay lambda of the eligibility traces (2.20); 0 for no traces', 0, 1)
    trace_floor: float = _field(0.005, 'A trace that has faded below this is dropped', 0, 1)
    replacing_traces: bool = _field(
        False, 'A visit sets the trace to 1 instead of adding 1 to it')
    cuts_traces: bool = _field(
        True, 'Off policy, all traces end before an action that is not greedy (Watkins)')
    temperature: float = _field(1.0, 'First temperature of the softmax (2.24)', TINY, ANY)
    temperature_factor: float = _field(
        0.99, 'Factor on the temperature after each iteration (2.25)', 0, 1)
    temperature_floor: float = _field(TINY, 'The temperature never falls below this', TINY, ANY)
    cooling_confidence: float = _field(
        1.0, 'The temperature falls only while the confidence p is at or below this', 0, 1)
    trust: str = _field(
        'none', 'Whom to trust: nobody, or the mentor: by a schedule (3.6), by a Beta belief '
        '(3.7), by the values of listening and discarding (3.11), as one more opinion (policy '
        'shaping), in the first steps of an episode (jump start), or by a higher first value '
        '(head start)', choices=TRUSTS)
    excludes_refused: bool = _field(
        False, 'A refused recommendation is left out of the own choice (3.2)')
    confidence: float = _field(
        0.9, 'First confidence p of scheduled trust (3.2), or how often advice is right in '
        'policy shaping', 0, 1)
    confidence_factor: float = _field(1.0, 'Factor on p after each iteration (3.6)', 0, 1)
    reuse_factor: float = _field(
        1.0, 'Factor on p of scheduled trust after each step of an episode (pi-reuse)', 0, 1)
    belief_listen: float = _field(
        8.0, 'First alpha of the Beta belief, first value of listening (3.13), or head start of '
        'the advice over the other actions', -ANY, ANY)
    belief_discard: float = _field(
        2.0, 'First beta of the Beta belief, or first value of discarding', -ANY, ANY)
    learns_prior: bool = _field(
        False, 'The belief in a state never left begins at the mean over all states left, not at '
        'the two numbers above (section 5.3)')
    exploration_probability: float = _field(
        0.4, 'Head start: chance to try an action that was never tried, where there is no advice; '
        'with advice, times the share of all advice that is not the best action here', 0, 1)
    trust_rate: float = _field(
        1.0, 'Rate of the Beta belief, gamma of (4.2), or weight of the new value, 1 - beta '
        'of (3.12)', 0, 1000)
    trust_rate_factor: float = _field(
        1.0, 'Factor on the rate of the Beta belief after each iteration', 0, 1)
    sign_only: bool = _field(False, 'The Beta belief learns from the sign of delta alone')
    bounded_belief: bool = _field(False, 'alpha and beta of the Beta belief are cut at 0')
    updates_both: bool = _field(
        True, 'Explicit trust updates listening and discarding at every step (3.12), not only '
        'what was done')
    listen_temperature: float = _field(
        0.5, 'First temperature of the choice between listening and discarding (3.11)', TINY, ANY)
    listen_temperature_exponent: float = _field(
        0.55, 'That temperature falls with the visits n of the state as 1 / n^exponent', 0, 2)
    guided_steps: int = _field(
        320, 'Jump start: the mentor leads the first steps of an episode, so many at first',
        0, 1_000_000)
    guided_stages: int = _field(
        10, 'Jump start: it leads so many times, each time less far, then no more', 1, 1_000_000)
    guided_tolerance: float = _field(
        0.1, 'Jump start: it leads less far when an iteration is at most this share of the best '
        'return worse than the best', 0, 1)
    measuring_iterations: int = _field(
        0, 'So many iterations at the beginning only measure and do not learn', 0, 1_000_000)
    iterations: int = _field(
        400, 'Iterations to learn for, then rest (0: without end)', 0, 1_000_000_000)
    episodes: int = _field(15, 'Episodes per iteration', 1, 1_000_000)

    def __post_init__(self):
        for row in fields(self):
            _check(row, getattr(self, row.name))
        if self.replays and self.visit_growth != 1.0:
            raise ConfigError('visit_growth must be 1.0 where outcomes are replayed, '
                              f'got {self.visit_growth}')
        if self.trust == 'explicit' and self.trust_rate > 1:
            raise ConfigError('trust_rate must lie in [0, 1] where trust is explicit, '
                              f'got {self.trust_rate}')
        if self.trust == 'beta' and min(self.belief_listen, self.belief_discard) <= 0:
            raise ConfigError('belief_listen and belief_discard must be above 0 where trust is '
                              f'beta, got {self.belief_listen} and {self.belief_discard}')

    def numbers(self):
        """Return the fields as `KernelConfig`, which compiled code takes: `trust` by its index."""
        values = {row.name: getattr(self, row.name) for row in fields(self)}
        return KernelConfig(**{**values, 'trust': TRUSTS.index(self.trust)})

    def needs_mentor(self):
        """Tell whether a decision waits for a recommendation."""
        return self.trust != 'none'


KernelConfig = namedtuple('Numbers', [row.name for row in fields(LearnerConfig)])
CONFIG_FIELDS = {row.name: row for row in fields(LearnerConfig)}


def _check(row, value):
    if type(value) is not row.type:
        raise ConfigError(f'{row.name} must be {_kind(row.type)}, got {value!r}')
    choices, low, high = (row.metadata.get(key) for key in ('choices', 'low', 'high'))
    if choices and value not in choices:
        raise ConfigError(f'{row.name} must be one of {", ".join(choices)}, got {value!r}')
    if low is not None and not low <= value <= high:  # nan, too, lies nowhere
        raise ConfigError(f'{row.name} must lie in [{low}, {high}], got {value}')


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
    if name not in CONFIG_FIELDS:
        raise ConfigError(f'a method has no field {name!r}; it has {", ".join(CONFIG_FIELDS)}')
    kind = CONFIG_FIELDS[name].type
    words = {'true': True, 'false': False}
    try:
        value = words[text.lower()] if kind is bool else kind(text)
    except (KeyError, ValueError):
        raise ConfigError(f'{name} must be {_kind(kind)}, got {text!r}') from None
    return replace(method, **{name: value})
