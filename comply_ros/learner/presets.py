# SPDX-License-Identifier: Apache-2.0
"""The presets of learners: the settings of each method in the two profiles."""

from dataclasses import replace
from math import log
from typing import Any

from comply_ros.learner.learner_config import ConfigError, LearnerConfig, TINY
from comply_ros.numerics.similar_name import did_you_mean


def find_method(name: str, profile: str) -> LearnerConfig:
    """
    Return the settings of a method in a profile.

    Raises
    ------
    ConfigError: for an unknown name or profile.

    """
    if profile not in METHODS:
        raise ConfigError(f'a profile must be one of {", ".join(METHODS)}, got {profile!r}')
    if name not in METHODS[profile]:
        raise ConfigError(f'{did_you_mean(name, METHODS[profile], after=" ")}a method must be one '
                          f'of {", ".join(METHODS[profile])}, got {name!r}')
    return METHODS[profile][name]


def listening_lead(p: float, temperature: float) -> float:
    """First value of listening over discarding that makes p the confidence (3.13)."""
    return temperature * log(p / (1.0 - p))


def _published(**settings: Any) -> LearnerConfig:
    return LearnerConfig(temperature_floor=0.03, measuring_iterations=1, **settings)


def _as_the_text_says(config: LearnerConfig, **settings: Any) -> LearnerConfig:
    return replace(config, learning_rate_exponent=0.55, visit_growth=1.0, temperature_floor=TINY,
                   measuring_iterations=0, **settings)


PUBLISHED: dict[str, LearnerConfig] = {
    'sarsa': _published(
        initial_value=3.0, visit_growth=1 / 15, temperature=4.0, iterations=600),
    'q_learning': _published(
        off_policy=True, initial_value=1.0, learning_rate=0.8, learning_rate_exponent=0.505,
        temperature_factor=0.98, iterations=600, episodes=10),
    'sarsa_lambda': _published(
        initial_value=2.0, learning_rate=0.5, learning_rate_exponent=0.51, temperature=5.0,
        temperature_factor=0.97, trace_decay=0.8, iterations=200),
    'watkins': _published(
        off_policy=True, initial_value=2.0, learning_rate=0.8, learning_rate_exponent=0.505,
        visit_growth=1 / 15, temperature=2.0, temperature_factor=0.95, trace_decay=0.8,
        iterations=150),
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
REPORT: dict[str, LearnerConfig] = {
    'sarsa': _as_the_text_says(PUBLISHED['sarsa']),
    'q_learning': _as_the_text_says(PUBLISHED['q_learning']),
    'sarsa_lambda': _as_the_text_says(PUBLISHED['sarsa_lambda']),
    'watkins': _as_the_text_says(PUBLISHED['watkins']),
    'constant': _as_the_text_says(PUBLISHED['constant']),
    'vanishing': _as_the_text_says(PUBLISHED['vanishing'], cooling_confidence=1.0),
    'beta_implicit': _as_the_text_says(
        PUBLISHED['beta_implicit'], sign_only=False, bounded_belief=False,
        trust_rate=0.3),  # of the order of the prior (section 4.1.1): larger rates diverge
    'explicit': _as_the_text_says(
        PUBLISHED['explicit'], updates_both=True, belief_listen=listening_lead(0.9, 0.5)),
}

_ALONE = LearnerConfig(
    off_policy=True, initial_value=1.0, learning_rate=0.8, learning_rate_exponent=0.505,
    visit_growth=1 / 15, temperature=1.0, temperature_factor=0.98, temperature_floor=0.03,
    iterations=399)
_TEXTBOOK = LearnerConfig(  # of Sutton and Barto (2018), example 6.6: 500 episodes
    learning_rate=0.5, learning_rate_exponent=0.0, epsilon=0.1, iterations=100, episodes=5)
_PLANNING = LearnerConfig(  # the theory of R-MAX and MBIE-EB needs a discount below 1
    off_policy=True, untried_value=1.0, discount=0.99, iterations=399)
BASELINES = {
    # The constant method of the report, where the majority of several mentors counts.
    'majority_vote': replace(PUBLISHED['constant'], follows_majority=True),
    # Probabilistic policy reuse: follow with psi nu^h in step h of an episode, else explore
    # (Fernandez and Veloso, AAMAS 2006, pi-reuse; psi 1, nu 0.95 as there).
    'pi_reuse': replace(_ALONE, trust='scheduled', confidence=1.0, reuse_factor=0.95),
    # Advise: the advice is right with consistency C, and multiplies the softmax by the odds of
    # that (Griffith et al., Policy Shaping, NIPS 2013, C 0.9).
    'policy_shaping': replace(_ALONE, trust='shaping', confidence=0.9, excludes_refused=True),
    # Advise with an estimated consistency of each trainer (Yamagata et al., Reinforcement Learning
    # with Feedback from Multiple Humans with Diverse Skills, 2021, arXiv 2111.08596).
    'policy_shaping_estimated': replace(
        _ALONE, trust='shaping', estimates_consistency=True, excludes_refused=True),
    # RLPA: in each episode one mentor, by optimism in the face of uncertain returns (Azar, Lazaric
    # and Brunskill, Regret Bounds for RL with Policy Advice, ECML 2013, arXiv 1305.1027).
    'rlpa': replace(_ALONE, trust='returns'),
    # Jump-start RL: the mentor guides the first steps of every episode, in stages fewer
    # (Uchendu et al., Jump-Start Reinforcement Learning, ICML 2023, arXiv 2022, the curriculum).
    'jump_start': replace(_ALONE, trust='jump_start'),
    'sarsa_epsilon': _TEXTBOOK,
    'q_learning_epsilon': replace(_TEXTBOOK, off_policy=True),
    # Sutton and Barto (2018), (6.9).
    'expected_sarsa': replace(_TEXTBOOK, expects=True),
    # Van Hasselt, Double Q-learning, NIPS 2010; Sutton and Barto (2018), section 6.7.
    'double_q_learning': replace(_TEXTBOOK, off_policy=True, doubles=True),
    # Moore and Atkeson, Prioritized Sweeping, Machine Learning 13, 1993; as Dyna-Q: Sutton and
    # Barto (2018), section 8.4, with expected updates.
    'prioritized_sweeping': replace(
        _PLANNING, planner='prioritized_sweeping', untried_value=0.0, epsilon=0.1),
    # Brafman and Tennenholtz, R-MAX, JMLR 3, 2002; the largest reward is that seen so far.
    'r_max': replace(_PLANNING, planner='r_max'),
    # Strehl and Littman, Model-based Interval Estimation, JCSS 74, 2008: MBIE-EB, a bonus of
    # beta / sqrt(n). What is not known must be worth more than the bonuses of what is.
    'mbie_eb': replace(_PLANNING, planner='mbie_eb', initial_value=10.0),
    # Osband, Russo and Van Roy, (More) Efficient RL via Posterior Sampling, NIPS 2013; an action
    # is drawn anew when its samples have doubled: Ouyang et al., NIPS 2017 (there, all are).
    'psrl': replace(_PLANNING, planner='psrl'),
}

PUBLISHED['beta_implicit_off_policy'] = replace(  # section 4.4
    PUBLISHED['beta_implicit'], off_policy=True, learning_rate_exponent=0.2, sign_only=False,
    trust_rate_factor=0.99)
PUBLISHED['explicit_off_policy'] = replace(PUBLISHED['explicit'], off_policy=True)
REPORT['beta_implicit_off_policy'] = replace(REPORT['beta_implicit'], off_policy=True)
REPORT['explicit_off_policy'] = replace(REPORT['explicit'], off_policy=True)

for table in (PUBLISHED, REPORT):  # section 5.3 proposes eligibility traces
    for name in ('constant', 'vanishing', 'beta_implicit', 'explicit'):
        table[f'{name}_lambda'] = replace(table[name], trace_decay=0.8)
    table.update(BASELINES)

# The recommended action starts above the others and is followed until its value falls below one.
# How much is explored depends on how often the advice of this mentor, in all states, is the best
# action known: pooled trust with a learned prior (section 5.3). Values come from a model of usual
# outcomes, so that a single slip changes little.
_HEAD_START = LearnerConfig(
    trust='head_start', replays=True, off_policy=True, initial_value=3.0, belief_listen=0.3,
    belief_discard=0.0, exploration_probability=0.4, iterations=399)
# Full counts of outcomes, a prior for slips that all states share, and a mentor whose advice is
# followed as far as it proved good: docs/methods/model_based.md derives it.
_MODEL_BASED = LearnerConfig(
    learns_model=True, trust='track_record', off_policy=True, iterations=399)
for table in (PUBLISHED, REPORT):
    table.update(head_start=_HEAD_START, model_based=_MODEL_BASED)

METHODS = {'report': REPORT, 'published': PUBLISHED}
