# SPDX-License-Identifier: Apache-2.0
"""One look for all figures: a method has the same colour everywhere, a variant its own dashes."""

from matplotlib.figure import Figure

from comply_ros.plots.grid_plot import INK, write_picture

# Okabe and Ito's palette, told apart with any kind of colour vision.
COLOURS = {
    'sarsa': '#7f7f7f', 'q_learning': '#56B4E9', 'sarsa_lambda': '#000000', 'watkins': '#8c6d1f',
    'constant': '#CC79A7', 'vanishing': '#E69F00', 'beta_implicit': '#0072B2',
    'explicit': '#D55E00', 'pi_reuse': '#882255', 'policy_shaping': '#44AA99',
    'jump_start': '#999933', 'head_start': '#009E73', 'early': '#0072B2',
    'important': '#D55E00', 'mistakes': '#009E73'}
DASHES = {'sarsa': '--', 'q_learning': '--', 'sarsa_lambda': '--', 'watkins': '--',
          'pi_reuse': '-.', 'policy_shaping': '-.', 'jump_start': '-.'}
LIGHT = '#eee'


def look_of(label):
    """Colour and line style of a line by its label: a method, one of its variants, or both."""
    method = label.partition(',')[0].removesuffix('_off_policy').removesuffix('_lambda')
    if label in COLOURS:
        method = label
    dashes = DASHES.get(method, '-') if label.startswith(method) and label in COLOURS else '--'
    return {'color': COLOURS.get(method, INK), 'linestyle': dashes}


def new_figure(title, x, y, size=(6.6, 4.0)):
    """Return a figure and its axes, with a title and the names of the axes."""
    figure = Figure(figsize=size, layout='constrained')
    axes = figure.add_subplot()
    axes.set_title(title, loc='left', fontsize=12, color=INK)
    axes.set_xlabel(x, fontsize=11)
    axes.set_ylabel(y, fontsize=11)
    axes.tick_params(labelsize=10)
    axes.spines[['top', 'right']].set_visible(False)
    axes.grid(color=LIGHT)
    axes.set_axisbelow(True)
    return figure, axes


def save(figure, path):
    """Write a figure in the size of the page."""
    write_picture(figure, path, dpi=120, compression=9)
