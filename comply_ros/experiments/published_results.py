# SPDX-License-Identifier: Apache-2.0
"""What the runs behind the report's figures came to: 5 runs a cell, 399 iterations that count."""

from typing import NamedTuple


class Published(NamedTuple):
    """Time to convergence, reward ratio and regret; None where they are not known."""

    time: float
    ratio: float
    regret: float


# By method and by how good the mentor was, from the random policy (0) to the optimal one (1).
COMPLIANT = {
    'vanishing': {1.0: Published(122, 0.65, 315), 0.999: Published(121, 0.69, 282),
                  0.5: Published(202, -0.60, 1991)},
    'beta_implicit': {1.0: Published(1, None, 100), 0.999: Published(11, 0.86, 126),
                      0.5: Published(229, 0.18, 1227)},
    'explicit': {1.0: Published(19, 0.98, 96), 0.999: Published(8, 0.95, 91),
                 0.5: Published(209, 0.09, 1223)},
}
# Without a mentor; the time of sarsa and q_learning is of 599 iterations.
ALONE = {
    'sarsa': Published(519, -2.27, 9740), 'q_learning': Published(500, -1.01, 5732),
    'sarsa_lambda': Published(115, -3.69, 3249), 'watkins': Published(80, -3.07, 2089),
}
# The lowest regret of any method with each mentor; 0.0 stands for random and adversarial ones,
# with which none was run: there the best is to learn alone (watkins).
BEST_REGRET = {1.0: 96, 0.999: 91, 0.74: 568, 0.5: 1223, 0.0: 2089}

MEASURED_RANDOM = -69.1  # return of the random policy, as those runs measured it

# The settings that are handed down for these do not lead to their figures; these, near them, do:
# a prior mean of 0.9 and the raw delta for the Beta belief, slower trust for explicit compliance.
_PRIOR = {'belief_listen': 9.0, 'belief_discard': 1.0}
_SLOW_TRUST = {'trust_rate': 0.02, 'temperature': 1.0, 'temperature_factor': 0.98,
               'belief_listen': 1.5, 'listen_temperature': 0.25, 'excludes_refused': False}
NEAR = {
    'sarsa': {'visit_growth': 0.075},
    'watkins': {'learning_rate': 0.4, 'trace_decay': 0.6},
    'beta_implicit': {**_PRIOR, 'sign_only': False, 'visit_growth': 0.1, 'temperature': 2.0,
                      'initial_value': -1.0},
    'explicit': {**_SLOW_TRUST, 'visit_growth': 1.0},
    'beta_implicit_off_policy': {**_PRIOR, 'learning_rate_exponent': 0.505},
    'explicit_off_policy': _SLOW_TRUST,
}
