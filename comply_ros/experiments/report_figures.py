# SPDX-License-Identifier: Apache-2.0
"""The figures: of each its name, what the report's shows, how it is drawn, and its runs."""

from typing import NamedTuple

from comply_ros.experiments.published_results import COMPLIANT, NEAR
from comply_ros.experiments.training_runs import Run


class Mentors(NamedTuple):
    """Specs of the mentors: the optimal one, the report's first and second, one between them."""

    optimal: str = 'optimal'
    good: str = 'snapshot:0.999'
    fair: str = 'snapshot:0.74'
    bad: str = 'snapshot:0.5'

    def levels(self):
        """Table from how good a mentor is meant to be to its spec, best first."""
        return {1.0: self.optimal, 0.999: self.good, 0.74: self.fair, 0.5: self.bad}


class Figure(NamedTuple):
    """
    One figure.

    Attributes
    ----------
    name: as in the report, `4.15`; a word where the report has none.
    title: above it. showed: what the report's figure shows, one sentence.
    kind: which of the drawings it is.
    runs: table from the label of each line (or of what is drawn) to its `Run`; of a metric the
        label is (line, place on the x axis), of a learner without a mentor the place is None.
    grid: the map that it is about.
    axis: name of the x axis of a metric.

    """

    name: str
    title: str
    showed: str
    kind: str
    runs: dict
    grid: str = 'maze'
    axis: str = 'optimality of the mentor'

    def grown(self):
        """Return the runs of which it needs the growth."""
        return list(self.runs.values()) if self.kind == 'growth' else []

    def all_runs(self):
        """Return the runs that it needs: its own, and those that its verdict compares with."""
        own = [] if self.kind in ('advice', 'growth') else list(self.runs.values())
        return own + self.compared()

    def compared(self):
        """Return the runs of the vanishing learner that an adaptive one is compared with."""
        if self.kind != 'curves' or len(self.runs) != 1:
            return []
        (run,) = self.runs.values()
        return [run._replace(method='vanishing', settings=())] if run.method in COMPLIANT else []


def report_figures(profile, mentors):
    """List of the `Figure` of every result of the report, in its order."""
    figures = [*_chapter_2(profile), *_chapter_3(profile, mentors), *_chapter_4(profile, mentors)]
    return [each._replace(grid=maze_of(profile)) if each.grid == 'maze' else each
            for each in figures]


def maze_of(profile):
    """Name of the maze in which the figures of a profile were made."""
    return 'maze_as_run' if profile == 'published' else 'maze'


def alone(method, profile, iterations=400, maze=None):
    """`Run` of a learner without a mentor in the maze, as the report's figures show it."""
    settings = {**_near(method, profile), 'iterations': iterations}
    return Run(maze or maze_of(profile), profile, method, tuple(settings.items()))


def taught(method, profile, mentor, maze=None, **settings):
    """`Run` of a row in the maze, with these settings."""
    return Run(maze or maze_of(profile), profile, method, tuple(settings.items()), mentor)


def as_drawn(method, profile, mentor):
    """`Run` of a learner with a mentor in the maze, as the report's figures show it."""
    return taught(method, profile, mentor, **_near(method, profile))


def _near(method, profile):
    """Return the settings that lead to a published figure where the row's own do not."""
    return NEAR.get(method, {}) if profile == 'published' else {}


def _chapter_2(profile):
    free = Run('free_grid', profile, 'sarsa', (
        ('temperature', 2.0), ('initial_value', 5.0), ('learning_rate', 0.7),
        ('learning_rate_exponent', 0.55), ('visit_growth', 1.0), ('iterations', 600)))
    bar = Run('bar_grid', profile, 'q_learning', (
        ('temperature', 0.5), ('temperature_factor', 1.0), ('initial_value', 2.0),
        ('learning_rate', 0.7), ('learning_rate_exponent', 0.505), ('episodes', 15),
        ('iterations', 400)))
    for name, grid, of in (('2.1', 'free_grid', 'an empty 11 x 11 grid'),
                           ('2.2', 'bar_grid', 'the same grid with a bar of seven cells')):
        yield Figure(name, f'The world {grid}', f'{of}, the goal in the upper right corner',
                     'map', {}, grid)
    yield Figure('2.3', 'Optimal policy of free_grid', 'every arrow leads to the goal', 'policy',
                 {}, 'free_grid')
    yield Figure('2.4', 'Optimal policy of bar_grid', 'the agent keeps its distance from the bar',
                 'policy', {}, 'bar_grid')
    for name, grid in (('2.5', 'free_grid'), ('2.6', 'bar_grid')):
        yield Figure(name, f'Value iteration on {grid}',
                     'value iteration settles in a few dozen sweeps', 'sweeps', {}, grid)
    for name, run, of in (('2.7', free, 'SARSA on free_grid'),
                          ('2.9', bar, 'Q-learning on bar_grid')):
        yield Figure(name, f'{of}: change of the values', 'the action values settle', 'changes',
                     {run.method: run}, run.map)
        yield Figure(f'2.{int(name[-1]) + 1}', f'{of}: mean return',
                     'the return approaches that of the optimal policy', 'curves',
                     {run.method: run}, run.map)


def _chapter_3(profile, mentors):
    yield Figure('3.1', 'The world maze', 'four blocks of obstacles, the goal in the middle, '
                 'the starts in the corners', 'map', {})
    yield Figure('3.2', 'Optimal policy of maze', 'every corner is led round the blocks to the '
                 'middle', 'policy', {})
    yield Figure('3.3', 'Learning without a mentor', 'traces learn several times as fast as '
                 'TD(0), and all end a little below the optimal policy', 'curves', {
                     'sarsa': alone('sarsa', profile, 600),
                     'q_learning': alone('q_learning', profile, 600),
                     'sarsa_lambda': alone('sarsa_lambda', profile),
                     'watkins': alone('watkins', profile)})
    yield Figure('3.4', 'Mentors from a SARSA learner', 'the greedy policy is better than the '
                 'learner that it is taken from, and far from optimal', 'growth',
                 {'sarsa': alone('sarsa', profile, 600)})
    for name, mentor, of in (
            ('3.5', mentors.optimal, 'with the optimal mentor it is near optimal at once'),
            ('3.6', mentors.good, 'a slightly suboptimal mentor is copied and not surpassed')):
        yield Figure(name, f'Constant compliance, mentor {_short(mentor)}', of, 'curves',
                     {'constant': taught('constant', profile, mentor)})
    yield Figure('3.7', 'A mentor that loops', 'arrows of a suboptimal mentor lead in circles',
                 'advice', {'mentor': taught('constant', profile, mentors.bad)})
    for name, factor in (('3.8', 0.99), ('3.9', 0.97)):
        yield Figure(name, f'Vanishing compliance, factor {factor}',
                     'the return rises, then undershoots as the guidance fades, then becomes '
                     'optimal', 'curves',
                     {f'vanishing, mentor {_short(mentor)}': taught(
                         'vanishing', profile, mentor, confidence_factor=factor)
                      for mentor in (mentors.good, mentors.bad)})
    yield Figure('3.10', 'Densities of the Beta distribution', 'priors from undecided to sure',
                 'densities', {})


def _chapter_4(profile, mentors):
    first, second = mentors.good, mentors.bad
    yield from _of_method('beta_implicit', profile, first, second, 1)
    yield from _of_method('explicit', profile, first, second, 7)
    for name, mentor, showed in (
            ('4.13', first, 'the two adaptive learners avoid the undershoot of the vanishing one'),
            ('4.14', second, 'with a poor mentor all three need about the same time')):
        yield Figure(name, f'Compliant learners, mentor {_short(mentor)}', showed, 'curves',
                     {method: as_drawn(method, profile, mentor) for method in COMPLIANT})
    by_mentor = {(method, level): as_drawn(method, profile, mentor)
                 for method in COMPLIANT for level, mentor in mentors.levels().items()}
    with_alone = {**by_mentor, **{(method, None): alone(method, profile)
                                  for method in ('sarsa_lambda', 'watkins')}}
    yield Figure('4.15', 'Time to convergence', 'the times grow and become equal as the mentor '
                 'gets worse', 'time_to_convergence', by_mentor)
    yield Figure('4.16', 'Reward ratio until convergence', 'the two adaptive learners collect '
                 'more than the vanishing one', 'reward_ratio', by_mentor)
    for name, mentor, others, showed in (
            ('4.17', second, ('sarsa', 'q_learning'), 'far faster than TD(0), even with a poor '
             'mentor'),
            ('4.18', mentors.fair, ('sarsa_lambda', 'watkins'), 'as fast as traces without a '
             'mentor, or a little slower')):
        yield Figure(name, f'With a mentor ({_short(mentor)}) and without', showed, 'curves', {
            **{method: as_drawn(method, profile, mentor) for method in COMPLIANT},
            **{method: alone(method, profile) for method in others}})
    yield Figure('4.19', 'Time to convergence, and that of traces alone', 'comparable with traces '
                 'without a mentor', 'time_to_convergence', with_alone)
    yield Figure('4.20', 'Reward ratio, and that of traces alone', 'far better than traces '
                 'without a mentor', 'reward_ratio', with_alone)
    for name, method in (('4.21', 'beta_implicit'), ('4.22', 'explicit')):
        yield Figure(name, f'{method}: on-policy and off-policy', 'learning off-policy is better '
                     'with a poor mentor', 'curves',
                     {each: as_drawn(each, profile, second)
                      for each in (method, f'{method}_off_policy')})


def _of_method(method, profile, first, second, number):
    runs = [as_drawn(method, profile, mentor) for mentor in (first, second)]
    showed = (
        'no undershoot, and close to optimal in the end',
        'most states are sure, near 0 or near 1, and more near 0 with the worse mentor',
        'most wrong recommendations are discarded (red)')
    kinds = (('curves', 'learning curve'), ('histogram', 'trust over the states'),
             ('trust', 'trust map'))
    for (kind, of), text in zip(kinds, showed):
        for run in runs:
            yield Figure(f'4.{number}', f'{method}: {of}, mentor {_short(run.mentor)}', text,
                         kind, {method: run})
            number += 1


def _short(mentor):
    """Mentor without the folder and the ending of its file."""
    return mentor.rpartition('/')[2].removeprefix('file:').removesuffix('.txt')
