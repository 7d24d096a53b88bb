# SPDX-License-Identifier: Apache-2.0
"""The figures of the report: of each its name, its caption, how it is drawn, and its runs."""

from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

from comply_ros.experiments.extra_curves import EXTRA_CURVES
from comply_ros.experiments.published_results import (
    BAD,
    COMPLIANT_METHODS,
    FAIR,
    FITTED_SETTINGS,
    GOOD,
    OPTIMAL,
)
from comply_ros.experiments.training_runs import Run

TRACES = ('sarsa_lambda', 'watkins')


class Mentors(NamedTuple):
    """Specs of four mentors: the optimal one, the report's first and second, one between them."""

    optimal: str = 'optimal'
    good: str = 'snapshot:0.999'
    fair: str = 'snapshot:0.74'
    bad: str = 'snapshot:0.5'

    def by_optimality(self) -> dict[str, str]:
        """Return the specs by the optimality that the mentors are meant to have, best first."""
        return {OPTIMAL: self.optimal, GOOD: self.good, FAIR: self.fair, BAD: self.bad}


class Figure(NamedTuple):
    """
    One figure.

    name: as in the report, `4.15`; a word where the report has no such figure.
    caption: what the report's figure shows; for a figure of ours, what it is about.
    kind: a key of `PLOTS`, or `table` for runs that only the tables of the page need.
    runs: `{label: Run}`, one for each line. In a plot of a metric the label is a pair of the line
        and the tick on the x axis; the tick is None for a learner without a mentor.
    axis: label of the x axis of a metric.
    """

    name: str
    title: str
    caption: str
    kind: str
    runs: dict[Any, Run]
    map: str = 'maze'
    axis: str = 'optimality of the mentor'

    def is_of_report(self) -> bool:
        """Tell whether the report has this figure."""
        return self.name[0].isdigit()

    def extra_runs(self) -> list[Run]:
        """Return the runs of which it needs more than their cells: the curves of its kind."""
        return list(self.runs.values()) if self.kind in EXTRA_CURVES else []

    def all_runs(self) -> list[Run]:
        """Return the runs whose cells it needs, also those that only its verdict needs."""
        if self.kind in ('advice', 'growth', 'exchange'):
            return []
        runs = list(self.runs.values())
        if self.kind == 'curves' and len(runs) == 1 and runs[0].method in COMPLIANT_METHODS:
            runs.append(vanishing_counterpart(runs[0]))
        return runs


def all_runs(figures: Iterable[Figure]) -> list[Run]:
    """Return all different runs of the figures, in their order."""
    return list(dict.fromkeys(run for figure in figures for run in figure.all_runs()))


def vanishing_counterpart(run: Run) -> Run:
    """Return the run of the vanishing learner that an adaptive one is compared with."""
    return run._replace(method='vanishing', settings=())


def report_figures(profile: str, mentors: Mentors) -> list[Figure]:
    """Return the figures of all results of the report, in its order."""
    figures = [*_chapter_2(profile), *_chapter_3(profile, mentors), *_chapter_4(profile, mentors)]
    return [each._replace(map=maze_of(profile)) if each.map == 'maze' else each
            for each in figures]


def maze_of(profile: str) -> str:
    """Return the map of the maze in which the figures of a profile were made."""
    return 'maze_as_run' if profile == 'published' else 'maze'


def run_with_mentor(
        method: str, profile: str, mentor: str, maze: str | None = None, **settings) -> Run:
    """Return the run of a method in the maze with these settings changed."""
    return Run(maze or maze_of(profile), profile, method, tuple(settings.items()), mentor)


def fitted_run(method: str, profile: str, mentor: str, maze: str | None = None, **settings) -> Run:
    """Return the run of a learner as the report's figures show it."""
    fitted = FITTED_SETTINGS.get(method, {}) if profile == 'published' else {}
    return run_with_mentor(method, profile, mentor, maze, **fitted, **settings)


def run_alone(
        method: str, profile: str, iterations: int = 400, maze: str | None = None) -> Run:
    """Return the run of a learner without a mentor as the report's figures show it."""
    return fitted_run(method, profile, 'none', maze, iterations=iterations)


def _chapter_2(profile: str) -> Iterator[Figure]:
    free = Run('free_grid', profile, 'sarsa', (
        ('temperature', 2.0), ('initial_value', 5.0), ('learning_rate', 0.7),
        ('learning_rate_exponent', 0.55), ('visit_growth', 1.0), ('iterations', 600)))
    bar = Run('bar_grid', profile, 'q_learning', (
        ('temperature', 0.5), ('temperature_factor', 1.0), ('initial_value', 2.0),
        ('learning_rate', 0.7), ('learning_rate_exponent', 0.505), ('episodes', 15),
        ('iterations', 400)))
    for name, grid, caption in (('2.1', 'free_grid', 'an empty 11 x 11 grid'),
                                ('2.2', 'bar_grid', 'the same grid with a bar of seven cells')):
        yield Figure(name, f'The world {grid}', f'{caption}, the goal in the upper right corner',
                     'map', {}, grid)
    yield Figure('2.3', 'Optimal policy of free_grid', 'every arrow leads to the goal', 'policy',
                 {}, 'free_grid')
    yield Figure('2.4', 'Optimal policy of bar_grid', 'the agent keeps its distance from the bar',
                 'policy', {}, 'bar_grid')
    for name, grid in (('2.5', 'free_grid'), ('2.6', 'bar_grid')):
        yield Figure(name, f'Value iteration on {grid}',
                     'value iteration converges in a few dozen sweeps', 'sweeps', {}, grid)
    for number, run, title in ((7, free, 'SARSA on free_grid'),
                               (9, bar, 'Q-learning on bar_grid')):
        yield Figure(f'2.{number}', f'{title}: change of the values', 'the action values settle',
                     'changes', {run.method: run}, run.map)
        yield Figure(f'2.{number + 1}', f'{title}: mean return',
                     'the return approaches that of the optimal policy', 'curves',
                     {run.method: run}, run.map)


def _chapter_3(profile: str, mentors: Mentors) -> Iterator[Figure]:
    yield Figure('3.1', 'The world maze', 'four blocks of obstacles, the goal in the middle, '
                 'the starts in the corners', 'map', {})
    yield Figure('3.2', 'Optimal policy of maze', 'the arrows lead from every corner round the '
                 'blocks to the middle', 'policy', {})
    yield Figure('3.3', 'Learning without a mentor', 'traces learn several times as fast as '
                 'TD(0), and all end a little below the optimal policy', 'curves', {
                     **{method: run_alone(method, profile, 600)
                        for method in ('sarsa', 'q_learning')},
                     **{method: run_alone(method, profile) for method in TRACES}})
    yield Figure('3.4', 'Mentors from a SARSA learner', 'the greedy policy is better than the '
                 'learner that it is taken from, and far from optimal', 'growth',
                 {'sarsa': run_alone('sarsa', profile, 600)})
    for name, mentor, caption in (
            ('3.5', mentors.optimal, 'with the optimal mentor it is near optimal at once'),
            ('3.6', mentors.good, 'a slightly suboptimal mentor is copied and not surpassed')):
        yield Figure(name, f'Constant compliance, mentor {_short(mentor)}', caption, 'curves',
                     {'constant': run_with_mentor('constant', profile, mentor)})
    yield Figure('3.7', 'A mentor that loops', 'arrows of a suboptimal mentor lead in circles',
                 'advice', {'mentor': run_with_mentor('constant', profile, mentors.bad)})
    for name, factor in (('3.8', 0.99), ('3.9', 0.97)):
        yield Figure(name, f'Vanishing compliance, factor {factor}',
                     'the return rises, then undershoots as the guidance fades, then becomes '
                     'optimal', 'curves',
                     {f'vanishing, mentor {_short(mentor)}': run_with_mentor(
                         'vanishing', profile, mentor, confidence_factor=factor)
                      for mentor in (mentors.good, mentors.bad)})
    yield Figure('3.10', 'Densities of the Beta distribution', 'priors from undecided to certain',
                 'densities', {})


def _chapter_4(profile: str, mentors: Mentors) -> Iterator[Figure]:
    first, second = mentors.good, mentors.bad
    yield from _method_figures('beta_implicit', profile, (first, second), 1)
    yield from _method_figures('explicit', profile, (first, second), 7)
    for name, mentor, caption in (
            ('4.13', first, 'the two adaptive learners avoid the undershoot of the vanishing one'),
            ('4.14', second, 'with a poor mentor all three need about the same time')):
        yield Figure(name, f'Compliant learners, mentor {_short(mentor)}', caption, 'curves',
                     {method: fitted_run(method, profile, mentor)
                      for method in COMPLIANT_METHODS})
    by_mentor: dict[Any, Run] = {
        (method, optimality): fitted_run(method, profile, mentor)
        for method in COMPLIANT_METHODS for optimality, mentor in mentors.by_optimality().items()}
    with_alone = {**by_mentor, **{(method, None): run_alone(method, profile) for method in TRACES}}
    yield Figure('4.15', 'Time to convergence', 'the times grow and become equal as the mentor '
                 'gets worse', 'time_to_convergence', by_mentor)
    yield Figure('4.16', 'Reward ratio until convergence', 'the two adaptive learners collect '
                 'more than the vanishing one', 'reward_ratio', by_mentor)
    for name, mentor, others, caption in (
            ('4.17', second, ('sarsa', 'q_learning'), 'far faster than TD(0), even with a poor '
             'mentor'),
            ('4.18', mentors.fair, TRACES, 'as fast as traces without a mentor, or a little '
             'slower')):
        yield Figure(name, f'With a mentor ({_short(mentor)}) and without', caption, 'curves', {
            **{method: fitted_run(method, profile, mentor) for method in COMPLIANT_METHODS},
            **{method: run_alone(method, profile) for method in others}})
    yield Figure('4.19', 'Time to convergence, and that of traces alone', 'comparable with traces '
                 'without a mentor', 'time_to_convergence', with_alone)
    yield Figure('4.20', 'Reward ratio, and that of traces alone', 'far better than traces '
                 'without a mentor', 'reward_ratio', with_alone)
    for name, method in (('4.21', 'beta_implicit'), ('4.22', 'explicit')):
        yield Figure(name, f'{method}: on-policy and off-policy', 'learning off-policy is better '
                     'with a poor mentor', 'curves',
                     {each: fitted_run(each, profile, second)
                      for each in (method, f'{method}_off_policy')})


def _method_figures(
        method: str, profile: str, mentors: tuple[str, str], number: int) -> Iterator[Figure]:
    """Yield three kinds of figures for each of two mentors, from `4.number` on."""
    for kind, title, caption in (
            ('curves', 'learning curve', 'no undershoot, and close to optimal in the end'),
            ('histogram', 'trust over the states', 'most confidences are near 0 or near 1, and '
             'more of them near 0 with the worse mentor'),
            ('trust', 'trust map', 'most wrong recommendations are discarded (red)')):
        for mentor in mentors:
            yield Figure(f'4.{number}', f'{method}: {title}, mentor {_short(mentor)}', caption,
                         kind, {method: fitted_run(method, profile, mentor)})
            number += 1


def _short(mentor: str) -> str:
    """Return a mentor's spec without the folder and the suffix of its file."""
    return mentor.rpartition('/')[2].removeprefix('file:').removesuffix('.txt')
