# SPDX-License-Identifier: Apache-2.0
"""What the page of results says beside its numbers."""

INTRODUCTION = """# Results

Written by `{command}`; every number and every "agrees" on this page is computed by it.
Profile `{profile}`, {seeds} seeds a cell. {agree} of {all} figures agree with what the report's
show. Curves are means over the seeds, smoothed over a few iterations, with a band from the 10th to
the 90th percentile; numbers behind "±" span 95 % (bootstrap over the seeds). The metrics:

* **T**, time to convergence: profile `published`: how many iterations are at or below 4.9, where
  the optimal policy has 5.84; `report`: after which iteration the return stays above 99 % of it.
* **ratio**: the return collected in the first T iterations, over the optimal policy's.
* **regret**: the sum over the iterations of what is missing to the optimal return.
"""

DIFFERENCES = """
## Where the text and the published runs differ

Both are here, as profiles. `--profile report` does what the text says, `--profile published` what
the runs behind its figures did:

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

HEAD_START = """It is one row with one setting for
all mentors, that works in the nodes like any other. Advice is a head start: the recommended action
begins a little above the others, and is followed until experience puts it below one. Where it ends
up is learned from remembered outcomes: where each action usually led and what it earned, replayed
backwards when an episode ends. How often it tries what it never tried depends on how often the
advice of this mentor, in all states so far, is the best action known: a prior that is learned.

It is no fair match for the others in one respect: it learns a model, and takes each action to have
one usual outcome, which a slip is an exception to. Where an action has several outcomes of equal
weight, its values are wrong, and the other rows are not. "Best published" with a random and an
adversarial mentor is the best learner without one (watkins); none was run with such mentors.
"""
