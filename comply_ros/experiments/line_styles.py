# SPDX-License-Identifier: Apache-2.0
"""Colour and line style of each method, the same in all figures."""

from typing import Any

from comply_ros.plots.grid_plot import INK

# Okabe and Ito's palette, told apart with any kind of colour vision.
COLOURS = {
    'sarsa': '#7f7f7f', 'q_learning': '#56B4E9', 'sarsa_lambda': '#000000', 'watkins': '#8c6d1f',
    'constant': '#CC79A7', 'vanishing': '#E69F00', 'beta_implicit': '#0072B2',
    'explicit': '#D55E00', 'pi_reuse': '#882255', 'policy_shaping': '#44AA99',
    'policy_shaping_estimated': '#661100', 'jump_start': '#999933', 'head_start': '#009E73',
    'model_based': '#332288',
    'early': '#0072B2', 'important': '#D55E00', 'mistakes': '#009E73'}
DASHES = {'sarsa': '--', 'q_learning': '--', 'sarsa_lambda': '--', 'watkins': '--',
          'pi_reuse': '-.', 'policy_shaping': '-.', 'jump_start': '-.'}


def line_style(label: str) -> dict[str, Any]:
    """Return colour and line style of a line by its label: a method, or one of its variants."""
    if label in COLOURS:
        return {'color': COLOURS[label], 'linestyle': DASHES.get(label, '-')}
    method = label.partition(',')[0].removesuffix('_off_policy').removesuffix('_lambda')
    return {'color': COLOURS.get(method, INK), 'linestyle': '--'}
