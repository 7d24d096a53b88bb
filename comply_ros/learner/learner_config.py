# SPDX-License-Identifier: Apache-2.0
"""The settings of a learner: their ranges and meaning, and the checks of their values."""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Callable
from dataclasses import dataclass, Field, field, fields, replace
from typing import Any

from comply_ros.numerics.action_values import actions_for_kernels
from comply_ros.numerics.number_text import read_integer, read_number
from comply_ros.numerics.similar_name import did_you_mean

TRUSTS = ('none', 'scheduled', 'beta', 'explicit', 'shaping', 'jump_start', 'head_start',
          'track_record', 'returns')
(NO_TRUST, SCHEDULED, BETA, EXPLICIT, SHAPING, JUMP_START, HEAD_START,
 TRACK_RECORD, RETURNS) = range(len(TRUSTS))

PLANNERS = 'none', 'prioritized_sweeping', 'r_max', 'mbie_eb', 'psrl'
NO_PLANNER, PRIORITIZED_SWEEPING, R_MAX, MBIE_EB, PSRL = range(len(PLANNERS))

TINY = 1e-9  # the softmax needs a temperature above 0
ANY = 1_000_000  # bound of a field that needs none


class ConfigError(ValueError):
    """A preset, field or value that does not exist; the message names the rule and the value."""


def _field(default: Any, text: str, low: float | None = None, high: float | None = None,
           **metadata: Any) -> Any:
    return field(default=default, metadata={'text': text, 'low': low, 'high': high, **metadata})


@dataclass(frozen=True)
class LearnerConfig:
    """
    Settings of one learner: how it updates, how it explores, whom it trusts.

    Every field is a parameter of the learner node and a FIELD of `--set FIELD=VALUE`; its
    metadata has the range and the meaning.

    Raises
    ------
    ConfigError: for a value of the wrong type or out of its range.

    """

    off_policy: bool = _field(
        False, 'Learn from the best next action (2.17), not from the chosen one (2.15)')
    expects: bool = _field(
        False, 'Learn from the mean value of the next action over the choices of the learner '
        '(expected SARSA), not from the one that it chose')
    doubles: bool = _field(
        False, 'Learn two tables of values, each from the value in one of the best action in the '
        'other (double Q-learning); q is their mean')
    replays: bool = _field(
        False, 'Compute action values from a model of the usual outcome of each action, backed up '
        'along the episode at its end, instead of (2.15) and (2.17)')
    learns_model: bool = _field(
        False, 'Compute action values from counts of all outcomes of each action, with a prior of '
        'slips that is learned over all states, backed up to the states that lead there')
    planner: str = _field(
        'none', 'Compute action values from counts of all outcomes of each action, without a '
        'prior of slips: of all that was tried (prioritized_sweeping), of what was tried often '
        'enough (r_max), with a bonus for what was tried seldom (mbie_eb), or of a model drawn '
        'for each episode (psrl)', choices=PLANNERS)
    known_after: int = _field(
        5, 'r_max: until an action was tried this many times, its value is that of one that was '
        'never tried', 1, ANY)
    count_bonus: float = _field(
        0.3, 'mbie_eb: what is added to the value of an action, over the root of how often it was '
        'tried', 0, ANY)
    unseen_weight: float = _field(
        0.01, 'psrl: the prior of an outcome not seen yet, which has the value of an action that '
        'was never tried, counts as much as this many samples', TINY, ANY)
    slip_prior: float = _field(
        0.0, 'learns_model: the prior of an action counts as much as this many samples; 0: as the '
        'one of 1, 2, 4, 8, 16 and 32 samples that has predicted outcomes best so far', 0, ANY)
    doubt_weight: float = _field(
        0.5, 'learns_model: weight of the chance that an action is better than the best one, and '
        'only looks worse for its few samples', 0, 1)
    untried_value: float = _field(
        0.65, 'learns_model and planner: value of an action that was never tried, as a share of '
        'the largest reward seen; for a planner, on top of initial_value', 0, 1)
    advice_slack: float = _field(
        0.12, 'track_record: error of an action value before there are samples, as a share of the '
        'largest reward; good advice may lie below the best action by the errors of both', 0, 1,
        trusts=('track_record',))
    discount: float = _field(1.0, 'Discount factor gamma of (2.2)', 0, 1)
    initial_value: float = _field(0.0, 'Action value of an action that was never tried', -ANY, ANY)
    learning_rate: float = _field(1.0, 'First learning rate of (2.26)', 0, 1)
    learning_rate_exponent: float = _field(
        1.0, 'The learning rate falls with the visits c as 1 / c^exponent (2.26)', 0, 2)
    visit_growth: float = _field(
        1.0, 'How much each visit of a state and action adds to its c, which starts at 1', 0, 1)
    trace_decay: float = _field(
        0.0, 'Decay lambda of the eligibility traces (2.20); 0 for no traces', 0, 1)
    trace_floor: float = _field(0.005, 'A trace that has faded below this is dropped', 0, 1)
    replacing_traces: bool = _field(
        False, 'A visit sets the trace to 1 instead of adding 1')
    cuts_traces: bool = _field(
        True, 'Off policy, all traces end before an action that is not greedy (Watkins)')
    temperature: float = _field(1.0, 'First temperature of the softmax (2.24)', TINY, ANY)
    temperature_factor: float = _field(
        0.99, 'Factor on the temperature after each iteration (2.25)', 0, 1)
    temperature_floor: float = _field(TINY, 'The temperature never falls below this', TINY, ANY)
    epsilon: float = _field(
        0.0, 'Probability of any action of the state, all equally likely, instead of the best one '
        '(epsilon-greedy); 0 for the softmax (2.24). head_start explores in its own way', 0, 1)
    cooling_confidence: float = _field(
        1.0, 'The temperature falls only while the confidence p is at most this', 0, 1)
    trust: str = _field(
        'none', 'How the confidence in the mentor is computed: none, by a schedule (3.6), by a '
        'Beta belief (3.7), from the values of listening and discarding (3.11), as a factor on '
        'the softmax (policy shaping), 1 in the first steps of an episode (jump_start), from a '
        'higher first action value (head_start), from how good the advice proved in a model '
        '(track_record), or 1 in one mentor for a whole episode, chosen by the returns with each '
        '(returns)', choices=TRUSTS)
    excludes_refused: bool = _field(
        False, 'An action that was recommended and not followed is excluded from the choice (3.2)')
    follows_majority: bool = _field(
        False, 'Of several mentors, one of those counts whose advice most of them give (majority '
        'vote), not the one with the highest confidence')
    confidence: float = _field(
        0.9, 'First confidence p of scheduled trust (3.2), or how often advice is right in '
        'policy shaping', 0, 1, trusts=('scheduled', 'shaping'))
    confidence_factor: float = _field(1.0, 'Factor on p after each iteration (3.6)', 0, 1,
                                      trusts=('scheduled', 'shaping'))
    estimates_consistency: bool = _field(
        False, 'Policy shaping: how often advice of a mentor is right is not given by confidence, '
        'but estimated from the action values and from what the others advise',
        trusts=('shaping',))
    reuse_factor: float = _field(
        1.0, 'Factor on p of scheduled trust after each step of an episode (pi-reuse)', 0, 1,
        trusts=('scheduled',))
    belief_listen: float = _field(
        8.0, 'First alpha of the Beta belief, first value of listening (3.13), or what head_start '
        'adds to the value of a recommended action', -ANY, ANY,
        trusts=('beta', 'explicit', 'head_start'))
    belief_discard: float = _field(
        2.0, 'First beta of the Beta belief, or first value of discarding', -ANY, ANY,
        trusts=('beta', 'explicit'))
    learns_prior: bool = _field(
        False, 'The first belief in a state is the mean over all states left before, not '
        'belief_listen and belief_discard (section 5.3)', trusts=('beta', 'explicit'))
    exploration_probability: float = _field(
        0.4, 'head_start and track_record: probability of trying an action that was never tried; '
        'where there is advice, times the share of all advice that is not the best action', 0, 1,
        trusts=('head_start', 'track_record'))
    trust_rate: float = _field(
        1.0, 'Rate of the Beta belief, gamma of (4.2), or weight of the new value, 1 - beta '
        'of (3.12)', 0, 1000, trusts=('beta', 'explicit'))
    trust_rate_factor: float = _field(
        1.0, 'Factor on the rate of the Beta belief after each iteration', 0, 1,
        trusts=('beta',))
    sign_only: bool = _field(
        False, 'The Beta belief is updated by the sign of delta alone', trusts=('beta',))
    bounded_belief: bool = _field(
        False, 'alpha and beta of the Beta belief are cut at 0', trusts=('beta',))
    updates_both: bool = _field(
        True, 'Explicit trust updates the values of listening and discarding at every step '
        '(3.12), not only that of the branch taken', trusts=('explicit',))
    listen_temperature: float = _field(
        0.5, 'First temperature of the choice between listening and discarding (3.11)', TINY, ANY,
        trusts=('explicit',))
    listen_temperature_exponent: float = _field(
        0.55, 'That temperature falls with the visits n of the state as 1 / n^exponent', 0, 2,
        trusts=('explicit',))
    guided_steps: int = _field(
        320, 'jump_start: number of first steps of an episode that the mentor guides, at first',
        0, 1_000_000, trusts=('jump_start',))
    guided_stages: int = _field(
        10, 'jump_start: number of stages in which the guided steps fall to 0', 1, 1_000_000,
        trusts=('jump_start',))
    guided_tolerance: float = _field(
        0.1, 'jump_start: the next stage begins when the return of an iteration is at most this '
        'share below the best one', 0, 1, trusts=('jump_start',))
    return_bonus: float = _field(
        0.1, 'returns: what is added to the mean return with a mentor, in ranges of the returns '
        'seen, times the root of 2 log(episodes) over its own episodes', 0, ANY,
        trusts=('returns',))
    learns: bool = _field(
        True, 'False: act by what was learned before, without exploration and without the mentor, '
        'and learn nothing; a node does so for ever, unless iterations is given too')
    measuring_iterations: int = _field(
        0, 'Number of first iterations that only measure and do not learn', 0, 1_000_000)
    iterations: int = _field(
        400, 'Number of iterations (0: no limit)', 0, 1_000_000_000)
    episodes: int = _field(15, 'Episodes per iteration', 1, 1_000_000)

    def __post_init__(self) -> None:
        for each in fields(self):
            _check(each, getattr(self, each.name))
        self._check_planner()
        for name in ('replays', 'learns_model'):
            if getattr(self, name) and self.visit_growth != 1.0:
                raise ConfigError(f'visit_growth must be 1.0 where {name} is true, '
                                  f'got {self.visit_growth}')
        for name in ('replays', 'expects', 'doubles'):
            if self.learns_model and getattr(self, name):
                raise ConfigError(f'{name} must be false where learns_model is true, got true')
        if self.learns_model and self.trust not in ('none', 'track_record'):
            raise ConfigError('trust must be none or track_record where learns_model is true, '
                              f'got {self.trust!r}')
        if self.trust == 'track_record' and not self.learns_model:
            raise ConfigError('learns_model must be true where trust is track_record, got false')
        if self.expects and (self.off_policy or self.replays or self.trust != 'none'):
            raise ConfigError(
                'off_policy and replays must be false and trust none where expects is true, got '
                f'{str(self.off_policy).lower()}, {str(self.replays).lower()} and {self.trust}')
        if self.doubles and (not self.off_policy or self.replays or self.trust != 'none'
                             or self.trace_decay > 0.0):
            raise ConfigError(
                'off_policy must be true, replays false, trust none and trace_decay 0 where '
                f'doubles is true, got {str(self.off_policy).lower()}, '
                f'{str(self.replays).lower()}, {self.trust} and {self.trace_decay}')
        if self.trust == 'explicit' and self.trust_rate > 1:
            raise ConfigError('trust_rate must lie in [0, 1] where trust is explicit, '
                              f'got {self.trust_rate}')
        if self.trust == 'beta' and min(self.belief_listen, self.belief_discard) <= 0:
            raise ConfigError('belief_listen and belief_discard must be above 0 where trust is '
                              f'beta, got {self.belief_listen} and {self.belief_discard}')

    def _check_planner(self) -> None:
        if self.planner == 'none':
            return
        for name, value in (('learns_model', False), ('replays', False), ('expects', False),
                            ('doubles', False), ('trust', 'none'), ('visit_growth', 1.0),
                            ('trace_decay', 0.0)):
            if getattr(self, name) != value:
                raise ConfigError(f'{name} must be {field_text(value)} where planner is '
                                  f'{self.planner}, got {field_text(getattr(self, name))}')
        if self.planner == 'mbie_eb' and self.discount == 1.0:
            raise ConfigError('discount must be below 1 where planner is mbie_eb, got 1.0')

    def for_kernels(self, n_actions: int, n_mentors: int = 1) -> KernelConfig:
        """
        Return the fields as a tuple for kernels, `trust` and `planner` as numbers.

        n_actions: of the world; the field `actions` has it, see `actions_for_kernels`. The field
            `has_model` has one element with a model and none without, `has_planner` with a
            planner, `has_estimates` where the consistency of mentors is estimated, `has_bandit`
            where one is chosen for an episode, and `mentors` one for each mentor: lengths that the
            compiler knows, so that each has machine code of its own.
        """
        values = {name: getattr(self, name) for name in CONFIG_FIELDS}
        values |= {'trust': TRUSTS.index(self.trust), 'planner': PLANNERS.index(self.planner)}
        return KernelConfig(**values, actions=actions_for_kernels(n_actions),
                            has_model=(1,) if self.learns_model else (),
                            has_planner=(1,) if self.planner != 'none' else (),
                            has_estimates=(1,) if self.shapes_by_estimates() else (),
                            has_bandit=(1,) if self.trust == 'returns' else (),
                            mentors=n_mentors * (1,))

    def needs_mentor(self) -> bool:
        """Tell whether a decision waits for a recommendation."""
        return self.learns and self.trust != 'none'

    def shapes_by_estimates(self) -> bool:
        """Tell whether advice is weighed by the estimated consistency of each mentor."""
        return self.trust == 'shaping' and self.estimates_consistency

    def uses(self, name: str) -> bool:
        """Tell whether the trust that is set depends on a field."""
        of_confidence = name in ('confidence', 'confidence_factor')
        return (self.trust in CONFIG_FIELDS[name].metadata.get('trusts', TRUSTS)
                or of_confidence and self.cooling_confidence < 1.0)

    def trusts_by_time(self) -> bool:
        """Tell whether the confidence depends on the step of the episode, not on the state."""
        return (self.trust == 'jump_start'
                or self.trust == 'scheduled' and self.reuse_factor != 1.0)


CONFIG_FIELDS = {each.name: each for each in fields(LearnerConfig)}
KernelConfig: Any = namedtuple('KernelConfig', (
    *CONFIG_FIELDS, 'actions', 'has_model', 'has_planner', 'has_estimates', 'has_bandit',
    'mentors'))
TYPES = {'bool': bool, 'int': int, 'float': float, 'str': str}  # as the fields are annotated
PARSERS: dict[type, Callable[[str], Any]] = {
    bool: lambda text: {'true': True, 'false': False}[text.lower()], int: read_integer,
    float: lambda text: float(read_number(text)), str: str}
KINDS: dict[type, str] = {
    bool: 'true or false', int: 'a whole number', float: 'a number such as 1.0', str: 'text'}


def field_type(name: str) -> type:
    """Type of the values of a field: bool, int, float or str."""
    return TYPES[str(CONFIG_FIELDS[name].type)]


def field_text(value: Any) -> str:
    """Return the value of a field as it is written in YAML."""
    return str(value).lower() if isinstance(value, bool) else str(value)


def _check(each: Field[Any], value: Any) -> None:
    kind = TYPES[str(each.type)]
    if type(value) is not kind:
        raise ConfigError(f'{each.name} must be {KINDS[kind]}, got {value!r}')
    choices, low, high = (each.metadata.get(key) for key in ('choices', 'low', 'high'))
    if choices and value not in choices:
        raise ConfigError(f'{each.name} must be one of {", ".join(choices)}, got {value!r}')
    if low is not None and not low <= value <= high:  # nan, too, is not in the range
        raise ConfigError(f'{each.name} must lie in [{low}, {high}], got {value}')


def with_text(config: LearnerConfig, name: str, text: str) -> LearnerConfig:
    """
    Return the settings with one field read from text, as in `--set NAME=TEXT`.

    Raises
    ------
    ConfigError: for an unknown field, a text of the wrong type, a value out of its range.

    """
    if name not in CONFIG_FIELDS:
        raise ConfigError(f'{did_you_mean(name, CONFIG_FIELDS, after=" ")}a method has no field '
                          f'{name!r}; it has {", ".join(CONFIG_FIELDS)}')
    kind = field_type(name)
    try:
        value = PARSERS[kind](text)
    except (KeyError, ValueError):
        raise ConfigError(f'{name} must be {KINDS[kind]}, got {text!r}') from None
    return replace(config, **{name: value})
