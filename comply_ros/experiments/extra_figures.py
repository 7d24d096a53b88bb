# SPDX-License-Identifier: Apache-2.0
"""Figures that the report has not: what it left open (section 5.3), and what does better."""

from comply_ros.experiments.published_results import COMPLIANT
from comply_ros.experiments.report_figures import alone, as_drawn, Figure, maze_of, taught
from comply_ros.experiments.training_runs import Run
from comply_ros.mentor.advice_budget import ADVISING_MODES

MAZE = 'maze'  # with slips that can bump, as the report describes it: the harder one
OURS = 'head_start'
THREE = tuple(COMPLIANT)  # of the report
LENGTHS = {'sarsa': 600, 'q_learning': 600, 'sarsa_lambda': 400, 'watkins': 400}
BASELINES = ('pi_reuse', 'policy_shaping', 'jump_start')
COMPARED = (*THREE, 'explicit_lambda', *BASELINES, OURS)
COVERAGES = (1.0, 0.5, 0.2, 0.1, 0.0)
BUDGETS = (10, 30, 100, 300, 1000)
TEACHERS = {'100 %': 'optimal', '99.9 %': None, '~74 %': None, '50 %': None, 'random': 'random',
            'adversarial': 'adversarial'}

TRIED_WITH = ('100 %', '99.9 %', '~74 %', '50 %', 'adversarial')
# Variants of our learner and of the report's: what each changes, by name.
TRIED = {
    'no head start': (OURS, {'belief_listen': 0.0}),
    'half the head start': (OURS, {'belief_listen': 0.15}),
    'twice the head start': (OURS, {'belief_listen': 0.6}),
    'no exploration': (OURS, {'exploration_probability': 0.0}),
    'half the exploration': (OURS, {'exploration_probability': 0.2}),
    'twice the exploration': (OURS, {'exploration_probability': 0.8}),
    'first values 0': (OURS, {'initial_value': 0.0}),
    'first values 6': (OURS, {'initial_value': 6.0}),
    'one-step Q-learning instead of outcomes': (
        OURS, {'replays': False, 'learning_rate_exponent': 0.2}),
    'Watkins traces instead of outcomes': (
        OURS, {'replays': False, 'learning_rate_exponent': 0.2, 'trace_decay': 0.8}),
    'explicit trust with outcomes': (
        'explicit', {'replays': True, 'visit_growth': 1.0, 'off_policy': True}),
    'Beta trust with outcomes': (
        'beta_implicit', {'replays': True, 'visit_growth': 1.0, 'off_policy': True}),
    'explicit trust with traces': ('explicit_lambda', {}),
    'Beta trust with traces': ('beta_implicit_lambda', {}),
    'explicit trust, off-policy': ('explicit_off_policy', {}),
}


def teachers(mentors):
    """Table from how a mentor is called to its spec: from the best to the worst."""
    return {**TEACHERS, '99.9 %': mentors.good, '~74 %': mentors.fair, '50 %': mentors.bad}


def at_its_best(method, profile, mentor):
    """`Run` in the harder maze, with the settings that are nearest to what was published."""
    return as_drawn(method, profile, mentor)._replace(map=MAZE)


def own_figures(profile, mentors):
    """List of the `Figure` of what goes beyond the report."""
    return [*_better(profile, mentors), *_open_questions(profile, mentors),
            *_tables(profile, mentors)]


def _better(profile, mentors):
    alone_too = {(f'{OURS}, alone', None): taught(OURS, profile, 'none', MAZE)}
    yield Figure('regret', 'Regret with every mentor', 'The regret of every way of complying, '
                 'from optimal to adversarial mentors; "alone" is our learner without a mentor',
                 'regrets', {**{(method, name): at_its_best(method, profile, mentor)
                                for method in COMPARED
                                for name, mentor in teachers(mentors).items()}, **alone_too},
                 axis='mentor')
    yield Figure('curves', 'Learning with the mentor of 50 %', 'How fast each learns with a '
                 'mentor that loops', 'curves', {method: at_its_best(method, profile, mentors.bad)
                                          for method in ('explicit', 'policy_shaping', OURS)})


def _open_questions(profile, mentors):
    yield Figure('coverage', 'Sparse demonstrations', 'A mentor of 75 % that has advice in a '
                 'share of the states only', 'regrets',
                 {(method, f'{coverage:.0%}'): taught(
                     method, profile, f'snapshot:0.75@{coverage}', MAZE)
                  for method in (*THREE, OURS) for coverage in COVERAGES},
                 axis='share of the states with advice')
    yield Figure('budget', f'An advice budget ({OURS}, optimal mentor)', 'An optimal mentor with '
                 'N recommendations to give: in the first states, where much depends on it, or '
                 'where the learner did something else the last time', 'regrets',
                 {(when, budget): Run(MAZE, profile, OURS, (), 'optimal', 0, budget, when)
                  for when in ADVISING_MODES for budget in BUDGETS}, axis='recommendations')
    priors = {'': {}, ', learned prior': {'learns_prior': True}}
    yield Figure('prior', 'Learned priors', 'The belief in a state that was never left begins as '
                 'it is set, or is learned from all other states', 'regrets',
                 {(f'{method}{name}', column): taught(method, profile, mentor, MAZE, **settings)
                  for name, settings in priors.items() for method in THREE[1:]
                  for column, mentor in teachers(mentors).items()}, axis='mentor')


def _tables(profile, mentors):
    named, levels = teachers(mentors), mentors.levels()
    yield Figure('tried', 'Variants', '', 'table',
                 {(name, column): taught(method, profile, named[column], MAZE, **settings)
                  for name, (method, settings) in TRIED.items()
                  for column in TRIED_WITH})
    yield Figure('rows', 'The settings as they are handed down', '', 'table',
                 {**{(method, level): taught(method, profile, mentor)
                     for method in THREE[1:] for level, mentor in levels.items()},
                  **{(method, None): Run(maze_of(profile), profile, method,
                                         (('iterations', LENGTHS[method]),))
                     for method in ('sarsa', 'watkins')}})
    yield Figure('text', 'What the text of the report leads to', '', 'table',
                 {(method, level): Run(MAZE, 'report', method, (), levels[level])
                  for method in THREE for level in (1.0, 0.999, 0.5)})
    yield Figure('both_mazes', 'The published tables with slips that can bump', '', 'table',
                 {**{(method, level): at_its_best(method, profile, mentor)
                     for method in THREE for level, mentor in levels.items()},
                  **{(method, None): alone(method, profile, length, MAZE)
                     for method, length in LENGTHS.items()}})
