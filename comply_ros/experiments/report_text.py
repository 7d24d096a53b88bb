# SPDX-License-Identifier: Apache-2.0
"""What the page of results says beside its numbers."""

INTRODUCTION = """# Results

Written by `{command}`; its measured numbers and every "agrees" are computed by it. Published
numbers are means of 5 runs a cell. Profile `{profile}`, {seeds} seeds a cell. {agree} of {all}
figures agree with what the report's show. Curves are means over the seeds, smoothed over a few
iterations, with a band from the 10th to the 90th percentile; numbers behind "±" are half of a
95 % interval (Student's t over the seeds). Trust maps and histograms are of the learner with
seed 0; maps and densities are definitions, and not counted. The metrics:

* **T**, time to convergence: profile `published`: how many iterations are at or below 4.9, where
  the optimal policy has 5.84; `report`: after which iteration the return stays above 99 % of it.
* **ratio**: the return collected in the first T iterations, over the optimal policy's; over the
  seeds with a T above 0.
* **regret**: the sum over the first 399 iterations of what is missing to the optimal return.

"Optimal" is the exact return of the world's best policy. In profile `published` T, ratio and
regret count from 5.8386, as those runs measured theirs, and the mentor "optimal" is the policy
that they planned: for slips that can bump, though in them none did.
"""

DIFFERENCES = """
## Where the text and the published runs differ

Both are here, as profiles. `--profile report` does what the text says, `--profile published`
what the runs behind its figures did:

| point | `report` | `published` |
|---|---|---|
| obstacle reward in `maze` | -10 | -5 |
| Beta belief (4.2) | the raw difference delta | its sign |
| alpha and beta | without bounds, so the rate is 0.3: larger ones run away | cut at 0 |
| explicit compliance (3.12) | both values at every step | only the value of what was done |
| p of vanishing compliance | the temperature falls from the start | only once p is below 0.5 |
| learning rate (2.26) | a0 / c^0.55, every visit counts 1 | a0 / c^e, by method |
| softmax | temperature to 0 | never below 0.03 |
| first iteration | learns | only measures, and is not counted |
| time to convergence | the return stays above 99 % | iterations at or below 4.9 |

In both, constant and vanishing compliance may choose the refused action themselves (section
3.4.1), the others may not (3.7).
"""

HEAD_START = """It is one row with one setting for all mentors, that works in the nodes like any
other. Advice is a head start: the recommended action begins a little above the others, and is
followed until experience puts it below one. Values come from remembered outcomes: where each
action usually led and what it earned, replayed backwards when an episode ends. How often it
tries what it never tried depends on how often the advice of this mentor, in all states so far,
is the best action known: a prior that is learned.

It is no fair match for the others in one respect: it learns a model, in which each action has
one usual outcome, and ignores where slips lead. Where slips are frequent or costly its policy
can be far from optimal where that of the other rows is not. Most of its lead comes from those
outcomes: alone it is already better than the others with the mentor of 50 %. What advice adds
is large with good mentors and small with bad ones, see below. Its settings were found on this
maze with other seeds, but for curiosity, which was doubled after a look at these.

"Best published" of ~74 % was kept back from the published tables; with a random and an
adversarial mentor it is the best learner without one (watkins), none was run with such
mentors. The report's three methods have the settings that come nearest to their published
numbers.
"""

SLIPS = """
In the published runs **a slip never ran into an obstacle**: the random policy, which they
measured at {measured}, has {as_run:.2f} with such slips (map `maze_as_run`), and {bumps:.2f}
where a slip takes any other action (`maze`, as the text describes it). With such slips
vanishing compliance comes out as published with every mentor; without (last column) it does
not with that of 99.9 %. For `q_learning` and `sarsa` the two hardly differ. The figures of
profile `published` are of `maze_as_run`."""

HANDED_DOWN = """
The rows of profile `published` have the settings that are handed down with the published runs.
For some methods these do not lead to the published numbers. The settings above, and in the
figures, do: they were **fitted afterwards to those very numbers**, by a random search near the
rows (some hundred settings, 6 to 30 seeds each), so their agreement shows that there are such
settings, not that these were used. They differ from the rows in:
"""

TEXT = """
## What the text of the report leads to

The same methods with `--profile report`, obstacles of -10, and convergence only when the
return stays above 99 % of the optimal one, which noise of a mini-batch of 15 episodes alone
prevents (T of 400 is "never"):
"""
