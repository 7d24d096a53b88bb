# SPDX-License-Identifier: Apache-2.0
"""Whether a figure of ours agrees with what the report's shows: computed, never typed in."""

from typing import NamedTuple

import numpy as np

from comply_ros.experiments.published_results import COMPLIANT
from comply_ros.experiments.results import LAST
from comply_ros.experiments.training_runs import Run
from comply_ros.world.grid import STEPS
from comply_ros.world.planning import optimal_policy, STOP_SHARE, sweeps_until, value_iteration

NEAR_OPTIMAL = 4.9  # the published runs' own mark for a learner that has arrived


class Verdict(NamedTuple):
    """Whether a figure agrees with the report's sentence, and the numbers that say so."""

    agrees: bool
    evidence: str


def _only(figure):
    (run,) = figure.runs.values()
    return run


def of_policy(results, figure):
    """Tell what the policy earns, and how many arrows point into an obstacle."""
    world = results.world(figure.grid)
    policy, states = optimal_policy(world), np.flatnonzero(world.free)
    x, y = world.grid.place(states)
    dx, dy = np.array(STEPS)[policy[states]].T
    bumps = int(world.obstacle[(y + dy) * world.grid.width + x + dx].sum())
    from_starts = results.return_at(Run(figure.grid, results.profile), 1)
    return Verdict(bumps == 0, f'{from_starts:.3f} an episode, and {bumps} of {len(states)} '
                   'arrows point into an obstacle')


def of_sweeps(results, figure):
    """Tell after how many sweeps (2.23) stops."""
    sweeps = value_iteration(results.world(figure.grid))
    stop = sweeps_until(STOP_SHARE, [change for _, (_, change) in zip(range(1000), sweeps)])
    return Verdict(bool(stop and stop < 100), f'(2.23) stops after {stop} sweeps')


def of_changes(results, figure):
    """Tell how much less the values change at the end."""
    changes = results.cell(_only(figure)).changes
    first, last = changes[:, :LAST].mean(), changes[:, -LAST:].mean()
    return Verdict(bool(last < first / 2), f'{first:.2f} in the first {LAST} iterations, '
                   f'{last:.2f} in the last')


def of_convergence(results, figure):
    """Tell how near to the optimal policy the learner ends, and its greedy policy."""
    run = _only(figure)
    random, optimal = (results.return_at(run, level) for level in (0, 1))
    share = results.share_of_optimal(run)
    greedy = (results.greedy_return(run) - random) / (optimal - random)
    return Verdict(share > 0.97, f'the learner ends at {results.end_of(run):.2f}, {share:.1%} of '
                   f'the way from the random to the optimal policy; its greedy policy is at '
                   f'{greedy:.1%}')


def of_classical(results, figure):
    """Tell the times of TD(0) and of traces."""
    times = {name: results.mean_of(run, 'time_to_convergence')
             for name, run in figure.runs.items()}
    ends = [results.share_of_optimal(run) for run in figure.runs.values()]
    slow, fast = min(times['sarsa'], times['q_learning']), max(times['sarsa_lambda'],
                                                               times['watkins'])
    return Verdict(fast < slow / 2 and min(ends) > 0.97, 'times to convergence: ' + ', '.join(
        f'{name} {time:.0f}' for name, time in times.items()))


def of_growth(results, figure):
    """Tell how often the greedy policy is better than the learner."""
    _, learner, greedy = results.growth(figure.runs['sarsa'])
    better = np.mean(np.array(greedy) > np.array(learner))
    return Verdict(bool(better > 0.5), f'the greedy policy is better in {better:.0%} of the '
                   'moments looked at')


def of_constant(results, figure):
    """Tell whether the learner stays with its mentor."""
    run = _only(figure)
    gap = results.mentor_return(run) - results.end_of(run)
    return Verdict(abs(gap) < 0.3, f'it ends at {results.end_of(run):.2f}; the mentor itself '
                   f'has {results.mentor_return(run):.2f}')


def of_loops(results, figure):
    """Tell how good the mentor is, and in how many states it is wrong."""
    run = figure.runs['mentor']
    wrong = results.wrong(run).sum() / results.world(figure.grid).free.sum()
    value = results.mentor_return(run)
    return Verdict(value < 0, f'return {value:.1f}; wrong in {wrong:.0%} of the states')


def of_vanishing(results, figure):
    """Tell how deep the undershoot is, and where the curves end."""
    drops = [results.undershoot(run) for run in figure.runs.values()]
    ends = [results.end_of(run) for run in figure.runs.values()]
    return Verdict(min(drops) > 0.5 and min(ends) > NEAR_OPTIMAL,
                   'it falls by ' + ' and '.join(f'{drop:.1f}' for drop in drops)
                   + ' after its first rise, and ends at '
                   + ' and '.join(f'{end:.2f}' for end in ends))


def of_adaptive(results, figure):
    """Tell how deep the curve falls against the vanishing learner's, and where it ends."""
    run = _only(figure)
    drop, end = results.undershoot(run), results.end_of(run)
    other = results.undershoot(run._replace(method='vanishing', settings=()))
    return Verdict(drop < other / 2 and end > NEAR_OPTIMAL,
                   f'it falls by {drop:.1f} after its first rise where vanishing falls by '
                   f'{other:.1f}, and ends at {end:.2f}')


def of_histogram(results, figure):
    """Tell how many states are sure."""
    values = np.array(results.trusted(_only(figure)))
    low, high = (values < 0.1).mean(), (values > 0.9).mean()
    return Verdict(low + high > 0.5, f'{low:.0%} of the visited states below 0.1, {high:.0%} '
                   'above 0.9')


def of_trust(results, figure):
    """Tell how many recommendations are discarded, of the wrong ones and of the others."""
    run = _only(figure)
    cell, wrong = results.cell(run), results.wrong(run)
    there = cell.visited & results.world(figure.grid).free
    bad, good = ((cell.confidence[there & kind] < 0.5).mean() for kind in (wrong, ~wrong))
    return Verdict(bool(bad > 0.5), f'of the wrong recommendations in states visited {bad:.0%} '
                   f'have a confidence below 0.5, of the others {good:.0%}')


def of_three(results, figure):
    """Tell the times and regrets of the three compliant learners."""
    regrets = {name: results.mean_of(run, 'regret') for name, run in figure.runs.items()}
    times = [results.mean_of(run, 'time_to_convergence') for run in figure.runs.values()]
    alike = max(times) < 1.5 * min(times)
    best = max(regrets['beta_implicit'], regrets['explicit']) < regrets['vanishing']
    return Verdict(best if figure.name == '4.13' else alike, 'times '
                   + ', '.join(f'{time:.0f}' for time in times) + '; regrets '
                   + ', '.join(f'{name} {value:.0f}' for name, value in regrets.items()))


def of_times(results, figure):
    """Tell how the times change with the mentor, and how much they differ with the worst."""
    times = {key: results.mean_of(run, figure.kind) for key, run in figure.runs.items()}
    grow = all(times[method, 1.0] < times[method, 0.5] for method in COMPLIANT)
    worst = [times[method, 0.5] for method in COMPLIANT]
    return Verdict(grow and max(worst) < 1.5 * min(worst), 'from the optimal mentor to that of '
                   '50 %: ' + ', '.join(f'{method} {times[method, 1.0]:.0f} to {end:.0f}'
                                        for method, end in zip(COMPLIANT, worst)))


def of_ratios(results, figure):
    """Tell whether the adaptive learners collect more."""
    ratios = {key: results.mean_of(run, figure.kind) for key, run in figure.runs.items()}
    worst = min(ratios['beta_implicit', 0.5], ratios['explicit', 0.5])
    return Verdict(worst > ratios['vanishing', 0.5], 'with the mentor of 50 %: ' + ', '.join(
        f'{method} {ratios[method, 0.5]:.2f}' for method in COMPLIANT))


def of_alone(results, figure):
    """Tell the times with a mentor and without."""
    times = {name: results.mean_of(run, 'time_to_convergence')
             for name, run in figure.runs.items()}
    ours = [times[name] for name in COMPLIANT]
    others = [value for name, value in times.items() if name not in COMPLIANT]
    agrees = max(ours) < min(others) if 'sarsa' in times else max(ours) < 2 * max(others)
    return Verdict(agrees, 'times: ' + ', '.join(
        f'{name} {value:.0f}' for name, value in times.items()))


def of_traces(results, figure):
    """Tell the compliant learners' measure against that of traces alone."""
    values = {key: results.mean_of(run, figure.kind) for key, run in figure.runs.items()}
    traces = [values[method, None] for method in ('sarsa_lambda', 'watkins')]
    ours = [values[method, 0.74] for method in COMPLIANT]
    agrees = (min(ours) > max(traces) if figure.kind == 'reward_ratio'
              else max(ours) < 2 * max(traces))
    return Verdict(agrees, 'with the mentor of 74 %: ' + ', '.join(
        f'{method} {values[method, 0.74]:.2f}' for method in COMPLIANT)
        + '; alone: ' + ', '.join(f'{method} {values[method, None]:.2f}'
                                  for method in ('sarsa_lambda', 'watkins')))


def of_off_policy(results, figure):
    """Tell the regret on-policy and off-policy."""
    on, off = (results.mean_of(run, 'regret') for run in figure.runs.values())
    return Verdict(off < on, f'regret {on:.0f} on-policy, {off:.0f} off-policy')


_BY_KIND = {
    'policy': of_policy, 'advice': of_loops, 'sweeps': of_sweeps, 'changes': of_changes,
    'growth': of_growth, 'histogram': of_histogram, 'trust': of_trust}
_BY_NAME = {
    '2.8': of_convergence, '2.10': of_convergence, '3.3': of_classical, '3.5': of_constant,
    '3.6': of_constant, '3.8': of_vanishing, '3.9': of_vanishing, '4.1': of_adaptive,
    '4.2': of_adaptive, '4.7': of_adaptive, '4.8': of_adaptive, '4.13': of_three,
    '4.14': of_three, '4.15': of_times, '4.16': of_ratios, '4.17': of_alone, '4.18': of_alone,
    '4.19': of_traces, '4.20': of_traces, '4.21': of_off_policy, '4.22': of_off_policy}


def verdict(results, figure):
    """`Verdict` on a figure of the report; None for one that is a definition, not a result."""
    judge = _BY_NAME.get(figure.name) or _BY_KIND.get(figure.kind)
    return judge and judge(results, figure)
