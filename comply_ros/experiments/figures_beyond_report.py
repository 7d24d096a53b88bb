# SPDX-License-Identifier: Apache-2.0
"""Figures beyond the report: its open questions (section 5.3), and methods that do better."""

from collections.abc import Iterator

from comply_ros.experiments.published_results import BAD, COMPLIANT_METHODS, FAIR, GOOD, OPTIMAL
from comply_ros.experiments.report_figures import (
    Figure,
    fitted_run,
    maze_of,
    Mentors,
    run_alone,
    run_with_mentor,
)
from comply_ros.experiments.training_runs import MENTOR_OF_SEED, Run
from comply_ros.mentor.advice_budget import ADVISING_MODES

MAZE = 'maze'  # with slips that can bump, as the report describes it: the harder one
OURS, WITH_MODEL = 'head_start', 'model_based'  # our two methods, the earlier one first
ITERATIONS_ALONE = {'sarsa': 600, 'q_learning': 600, 'sarsa_lambda': 400, 'watkins': 400}
BASELINES = ('explicit_lambda', 'pi_reuse', 'policy_shaping', 'jump_start')
TOGETHER = ('pi_reuse', 'explicit')  # one that ends better with a second learner, one worse
EXCHANGED = ('constant', 'beta_implicit', 'explicit', 'policy_shaping_estimated', OURS, WITH_MODEL)
EXCHANGES = (('noisy:0.3', 'adversarial'), ('adversarial', 'noisy:0.3'))  # of two mentors
COVERAGES = (1.0, 0.5, 0.2, 0.1, 0.0)
BUDGETS = (10, 30, 100, 300, 1000)

VARIANT_MENTORS = (OPTIMAL, GOOD, FAIR, BAD, 'adversarial')
_NO_MODEL = {'replays': False, 'learning_rate_exponent': 0.2}
_MODEL = {'replays': True, 'visit_growth': 1.0, 'off_policy': True}
VARIANTS = {  # of our learner and of the report's: the method, and the settings that are changed
    'no head start': (OURS, {'belief_listen': 0.0}),
    'half the head start': (OURS, {'belief_listen': 0.15}),
    'twice the head start': (OURS, {'belief_listen': 0.6}),
    'no exploration': (OURS, {'exploration_probability': 0.0}),
    'half the exploration': (OURS, {'exploration_probability': 0.2}),
    'twice the exploration': (OURS, {'exploration_probability': 0.8}),
    'first values 0': (OURS, {'initial_value': 0.0}),
    'first values 6': (OURS, {'initial_value': 6.0}),
    'one-step Q-learning instead of outcomes': (OURS, _NO_MODEL),
    'Watkins traces instead of outcomes': (OURS, {**_NO_MODEL, 'trace_decay': 0.8}),
    'explicit trust with outcomes': ('explicit', _MODEL),
    'Beta trust with outcomes': ('beta_implicit', _MODEL),
    'explicit trust with traces': ('explicit_lambda', {}),
    'Beta trust with traces': ('beta_implicit_lambda', {}),
    'explicit trust, off-policy': ('explicit_off_policy', {}),
}


def all_mentors(mentors: Mentors) -> dict[str, str]:
    """Return the specs of all mentors by their names in figures and tables, best first."""
    return {**mentors.by_optimality(), OPTIMAL: 'optimal', 'random': 'random',
            'adversarial': 'adversarial'}


def extra_figures(profile: str, mentors: Mentors) -> list[Figure]:
    """Return the figures that go beyond the report."""
    return [*_comparisons(profile, mentors), *_open_questions(profile, mentors),
            *_together(profile), *_exchanged(profile), *_table_runs(profile, mentors)]


def _comparisons(profile: str, mentors: Mentors) -> Iterator[Figure]:
    yield Figure('regret', 'Regret with every mentor', 'The regret of every way of complying, '
                 'from optimal to adversarial mentors; "alone" is our method without a mentor',
                 'regrets', {
                     **{(method, name): fitted_run(method, profile, mentor, MAZE)
                        for method in (*COMPLIANT_METHODS, *BASELINES, OURS, WITH_MODEL)
                        for name, mentor in all_mentors(mentors).items()},
                     **{(f'{method}, alone', None): run_with_mentor(method, profile, 'none', MAZE)
                        for method in (OURS, WITH_MODEL)}},
                 axis='mentor')
    yield Figure('curves', 'Learning with the mentor of 50 %', 'How fast each method learns with '
                 'a mentor that loops', 'curves',
                 {method: fitted_run(method, profile, mentors.bad, MAZE)
                  for method in ('explicit', 'policy_shaping', OURS, WITH_MODEL)})


def _together(profile: str) -> Iterator[Figure]:
    yield Figure('two_learners', 'Two learners that teach each other', 'Two learners without any '
                 'other mentor, each with the newest policy of the other as its advice, and the '
                 'same learners alone', 'together',
                 {method: run_with_mentor(method, profile, 'none', MAZE)
                  for method in TOGETHER})


def _exchanged(profile: str) -> Iterator[Figure]:
    yield Figure('mentor_exchange', 'A mentor that becomes bad or good half way', 'At half of the '
                 'iterations the policy of the mentor is exchanged for that of another one, and '
                 'nobody tells the learner', 'exchange',
                 {(method, f'{first}, then {second}'): fitted_run(
                     method, profile, f'{first} + {second}', MAZE)._replace(
                         mentor_seed=MENTOR_OF_SEED)
                  for first, second in EXCHANGES for method in EXCHANGED})


def _open_questions(profile: str, mentors: Mentors) -> Iterator[Figure]:
    yield Figure('coverage', 'Sparse demonstrations', 'A mentor of 75 % that has advice in a '
                 'share of the states only', 'regrets',
                 {(method, f'{coverage:.0%}'): run_with_mentor(
                     method, profile, f'snapshot:0.75@{coverage}', MAZE)
                  for method in (*COMPLIANT_METHODS, OURS) for coverage in COVERAGES},
                 axis='share of the states with advice')
    yield Figure('budget', f'An advice budget ({OURS}, optimal mentor)', 'An optimal mentor that '
                 'can give N recommendations: in the first states, where much depends on the '
                 'action, or where the learner last took another action', 'regrets',
                 {(when, budget): Run(MAZE, profile, OURS, (), 'optimal', 0, budget, when)
                  for when in ADVISING_MODES for budget in BUDGETS}, axis='recommendations')
    priors = {'': {}, ', learned prior': {'learns_prior': True}}
    yield Figure('prior', 'Learned priors', 'The belief in a state that was never left starts at '
                 'a fixed value, or at one that is learned from all other states', 'regrets',
                 {(f'{method}{name}', column): run_with_mentor(
                     method, profile, mentor, MAZE, **settings)
                  for name, settings in priors.items() for method in COMPLIANT_METHODS[1:]
                  for column, mentor in all_mentors(mentors).items()}, axis='mentor')


def _table_runs(profile: str, mentors: Mentors) -> Iterator[Figure]:
    by_name, specs = all_mentors(mentors), mentors.by_optimality()
    yield Figure('tried', 'Variants', '', 'table',
                 {(name, column): run_with_mentor(
                     method, profile, by_name[column], MAZE, **settings)
                  for name, (method, settings) in VARIANTS.items() for column in VARIANT_MENTORS})
    yield Figure('rows', 'The published settings', '', 'table',
                 {**{(method, None): Run(maze_of(profile), profile, method,
                                         (('iterations', ITERATIONS_ALONE[method]),))
                     for method in ('sarsa', 'watkins')},
                  **{(method, name): run_with_mentor(method, profile, mentor)
                     for method in COMPLIANT_METHODS[1:] for name, mentor in specs.items()}})
    yield Figure('text', 'What the text of the report leads to', '', 'table',
                 {(method, name): Run(MAZE, 'report', method, (), specs[name])
                  for method in COMPLIANT_METHODS for name in (OPTIMAL, GOOD, BAD)})
    yield Figure('both_mazes', 'The published tables with slips that can bump', '', 'table',
                 {**{(method, name): fitted_run(method, profile, mentor, MAZE)
                     for method in COMPLIANT_METHODS for name, mentor in specs.items()},
                  **{(method, None): run_alone(method, profile, iterations, MAZE)
                     for method, iterations in ITERATIONS_ALONE.items()}})
