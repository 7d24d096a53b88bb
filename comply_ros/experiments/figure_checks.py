# SPDX-License-Identifier: Apache-2.0
"""Whether a figure of ours agrees with what the report's shows: computed, never typed in."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from comply_ros.experiments.computed_results import END_ITERATIONS, Results
from comply_ros.experiments.published_results import BAD, COMPLIANT_METHODS, FAIR, OPTIMAL
from comply_ros.experiments.report_figures import Figure, TRACES, vanishing_counterpart
from comply_ros.experiments.training_runs import mentor_return, Run
from comply_ros.world.grid import STEPS
from comply_ros.world.planning import optimal_policy, STOP_SHARE, sweeps_until, value_iteration

NEAR_OPTIMAL = 4.9  # the published runs' own threshold for a learner that has converged


class Verdict(NamedTuple):
    """Whether a figure agrees with the report's sentence, and the numbers that show it."""

    agrees: bool
    evidence: str


def check_policy(results: Results, figure: Figure) -> Verdict:
    """Check that no arrow points into an obstacle."""
    world = results.world(figure.map)
    policy, states = optimal_policy(world), np.flatnonzero(world.free)
    x, y = world.grid.place(states)
    dx, dy = np.array(STEPS)[policy[states]].T
    bumps = int(world.obstacle[(y + dy) * world.grid.width + x + dx].sum())
    value = results.return_at(Run(figure.map, results.profile), 1)
    return Verdict(bumps == 0, f'{value:.3f} an episode, and {bumps} of {len(states)} arrows '
                   'point into an obstacle')


def check_sweeps(results: Results, figure: Figure) -> Verdict:
    """Check that value iteration stops by (2.23) within 100 sweeps."""
    sweeps = value_iteration(results.world(figure.map))
    stop = sweeps_until(STOP_SHARE, [change for _, (_, change) in zip(range(1000), sweeps)])
    return Verdict(bool(stop and stop < 100), f'(2.23) stops after {stop} sweeps')


def check_changes(results: Results, figure: Figure) -> Verdict:
    """Check that the values change by less than half as much at the end."""
    (run,) = figure.runs.values()
    changes = results.cell(run).changes
    first, last = changes[:, :END_ITERATIONS].mean(), changes[:, -END_ITERATIONS:].mean()
    return Verdict(bool(last < first / 2), f'{first:.2f} in the first {END_ITERATIONS} '
                   f'iterations, {last:.2f} in the last')


def check_convergence(results: Results, figure: Figure) -> Verdict:
    """Check that the learner ends near the optimal policy."""
    (run,) = figure.runs.values()
    end = results.end_of(run)
    level, greedy = (results.level_of(run, value) for value in (end, results.greedy_return(run)))
    return Verdict(level > 0.97, f'the learner ends at {end:.2f}, {level:.1%} of the way from the '
                   f'random to the optimal policy; its greedy policy is at {greedy:.1%}')


def check_traces_against_td0(results: Results, figure: Figure) -> Verdict:
    """Check that traces converge in half the time of TD(0), and all end near the optimum."""
    times = _times(results, figure)
    levels = [results.level_of(run, results.end_of(run)) for run in figure.runs.values()]
    slow, fast = min(times['sarsa'], times['q_learning']), max(times[name] for name in TRACES)
    return Verdict(fast < slow / 2 and min(levels) > 0.97, 'times to convergence: '
                   + _listed(times, '.0f'))


def check_greedy_curve(results: Results, figure: Figure) -> Verdict:
    """Check that the greedy policy is mostly better than the learner."""
    _, learner, greedy = results.greedy_curve(figure.runs['sarsa'])
    better = np.mean(np.array(greedy) > np.array(learner))
    return Verdict(bool(better > 0.5), f'the greedy policy is better at {better:.0%} of the '
                   'points measured')


def check_constant(results: Results, figure: Figure) -> Verdict:
    """Check that the learner ends at the return of its mentor."""
    (run,) = figure.runs.values()
    mentor, end = mentor_return(run), results.end_of(run)
    assert mentor is not None  # a constant learner has a mentor
    return Verdict(abs(mentor - end) < 0.3, f'it ends at {end:.2f}; the mentor itself has '
                   f'{mentor:.2f}')


def check_loops(results: Results, figure: Figure) -> Verdict:
    """Check that the mentor's return is below 0."""
    run = figure.runs['mentor']
    wrong = results.wrong(run).sum() / results.world(figure.map).free.sum()
    value = mentor_return(run)
    assert value is not None
    return Verdict(value < 0, f'return {value:.1f}; wrong in {wrong:.0%} of the states')


def check_vanishing(results: Results, figure: Figure) -> Verdict:
    """Check that the curves undershoot, and end near the optimum."""
    drops = [results.undershoot(run) for run in figure.runs.values()]
    ends = [results.end_of(run) for run in figure.runs.values()]
    return Verdict(min(drops) > 0.5 and min(ends) > NEAR_OPTIMAL,
                   'it falls by ' + ' and '.join(f'{drop:.1f}' for drop in drops)
                   + ' after its first rise, and ends at '
                   + ' and '.join(f'{end:.2f}' for end in ends))


def check_adaptive(results: Results, figure: Figure) -> Verdict:
    """Check that it undershoots by less than half of vanishing, and ends near the optimum."""
    (run,) = figure.runs.values()
    drop, end = results.undershoot(run), results.end_of(run)
    other = results.undershoot(vanishing_counterpart(run))
    return Verdict(drop < other / 2 and end > NEAR_OPTIMAL,
                   f'it falls by {drop:.1f} after its first rise where vanishing falls by '
                   f'{other:.1f}, and ends at {end:.2f}')


def check_histogram(results: Results, figure: Figure) -> Verdict:
    """Check that most confidences are near 0 or near 1."""
    (run,) = figure.runs.values()
    values = results.visited_confidence(run)
    low, high = (values < 0.1).mean(), (values > 0.9).mean()
    return Verdict(bool(low + high > 0.5), f'{low:.0%} of the visited states below 0.1, '
                   f'{high:.0%} above 0.9')


def check_trust(results: Results, figure: Figure) -> Verdict:
    """Check that most wrong recommendations are discarded."""
    (run,) = figure.runs.values()
    cell, wrong = results.cell(run), results.wrong(run)
    visited = cell.visited & results.world(figure.map).free
    bad, good = ((cell.confidence[visited & kind] < 0.5).mean() for kind in (wrong, ~wrong))
    return Verdict(bool(bad > 0.5), f'of the wrong recommendations in states visited {bad:.0%} '
                   f'have a confidence below 0.5, of the others {good:.0%}')


def check_compliant(results: Results, figure: Figure) -> Verdict:
    """Check that the adaptive have less regret (4.13), or all need about the same time (4.14)."""
    regrets = {name: results.mean_of(run, 'regret') for name, run in figure.runs.items()}
    times = list(_times(results, figure).values())
    alike = max(times) < 1.5 * min(times)
    best = max(regrets['beta_implicit'], regrets['explicit']) < regrets['vanishing']
    return Verdict(best if figure.name == '4.13' else alike, 'times '
                   + ', '.join(f'{time:.0f}' for time in times) + '; regrets '
                   + _listed(regrets, '.0f'))


def check_times(results: Results, figure: Figure) -> Verdict:
    """Check that the times grow as the mentor gets worse, and are alike with the worst."""
    times = {key: results.mean_of(run, figure.kind) for key, run in figure.runs.items()}
    grow = all(times[method, OPTIMAL] < times[method, BAD] for method in COMPLIANT_METHODS)
    worst = [times[method, BAD] for method in COMPLIANT_METHODS]
    return Verdict(grow and max(worst) < 1.5 * min(worst), 'from the optimal mentor to that of '
                   f'{BAD}: ' + ', '.join(f'{method} {times[method, OPTIMAL]:.0f} to {end:.0f}'
                                          for method, end in zip(COMPLIANT_METHODS, worst)))


def check_ratios(results: Results, figure: Figure) -> Verdict:
    """Check that the adaptive learners collect more than the vanishing one."""
    ratios = {method: results.mean_of(figure.runs[method, BAD], figure.kind)
              for method in COMPLIANT_METHODS}
    worst = min(ratios['beta_implicit'], ratios['explicit'])
    return Verdict(worst > ratios['vanishing'],
                   f'with the mentor of {BAD}: ' + _listed(ratios, '.2f'))


def check_against_alone(results: Results, figure: Figure) -> Verdict:
    """Check that learning is faster than by TD(0), or at least half as fast as with traces."""
    times = _times(results, figure)
    ours = [times[name] for name in COMPLIANT_METHODS]
    others = [value for name, value in times.items() if name not in COMPLIANT_METHODS]
    agrees = max(ours) < min(others) if 'sarsa' in times else max(ours) < 2 * max(others)
    return Verdict(agrees, 'times: ' + _listed(times, '.0f'))


def check_against_traces(results: Results, figure: Figure) -> Verdict:
    """Check that the time is below twice that of traces alone, or the ratio is better."""
    ours = {method: results.mean_of(figure.runs[method, FAIR], figure.kind)
            for method in COMPLIANT_METHODS}
    alone = {method: results.mean_of(figure.runs[method, None], figure.kind) for method in TRACES}
    agrees = (min(ours.values()) > max(alone.values()) if figure.kind == 'reward_ratio'
              else max(ours.values()) < 2 * max(alone.values()))
    return Verdict(agrees, 'with the mentor of 74 %: ' + _listed(ours, '.2f')
                   + '; alone: ' + _listed(alone, '.2f'))


def check_off_policy(results: Results, figure: Figure) -> Verdict:
    """Check that learning off-policy has less regret."""
    on, off = (results.mean_of(run, 'regret') for run in figure.runs.values())
    return Verdict(off < on, f'regret {on:.0f} on-policy, {off:.0f} off-policy')


def _times(results: Results, figure: Figure) -> dict:
    return {name: results.mean_of(run, 'time_to_convergence') for name, run in figure.runs.items()}


def _listed(values: dict, form: str) -> str:
    return ', '.join(f'{name} {value:{form}}' for name, value in values.items())


CHECKS_BY_KIND: dict[str, Callable[[Results, Figure], Verdict]] = {
    'policy': check_policy, 'advice': check_loops, 'sweeps': check_sweeps,
    'changes': check_changes, 'growth': check_greedy_curve, 'histogram': check_histogram,
    'trust': check_trust}
CHECKS_BY_NAME: dict[str, Callable[[Results, Figure], Verdict]] = {
    '2.8': check_convergence, '2.10': check_convergence, '3.3': check_traces_against_td0,
    '3.5': check_constant, '3.6': check_constant, '3.8': check_vanishing, '3.9': check_vanishing,
    '4.1': check_adaptive, '4.2': check_adaptive, '4.7': check_adaptive, '4.8': check_adaptive,
    '4.13': check_compliant, '4.14': check_compliant, '4.15': check_times, '4.16': check_ratios,
    '4.17': check_against_alone, '4.18': check_against_alone, '4.19': check_against_traces,
    '4.20': check_against_traces, '4.21': check_off_policy, '4.22': check_off_policy}


def verdict(results: Results, figure: Figure) -> Verdict | None:
    """Return the verdict on a figure of the report; None for a definition without a result."""
    check = CHECKS_BY_NAME.get(figure.name) or CHECKS_BY_KIND.get(figure.kind)
    return check(results, figure) if check else None
