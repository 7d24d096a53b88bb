# SPDX-License-Identifier: Apache-2.0
"""The learning curve as options of ECharts, which NiceGUI brings."""

import numpy as np

# Each is to be read on light and on dark.
BLUE, GREEN, ORANGE, GREY = '#2b8fd6', '#009E73', '#E69F00', '#8a919c'
WINDOW = 9  # iterations in the running mean, at most, as in session/pictures


def curve_options(curve, optimal, mentor):
    """
    Options of a chart of a `Curve` with the optimal and the mentor's level.

    optimal, mentor: expected returns, or None: no such level.
    """
    x, y = list(curve.iterations), list(curve.returns)
    levels = [('optimal', optimal, GREEN, 'solid'), ('mentor', mentor, ORANGE, 'dashed')]
    shown = [level for level in levels if level[1] is not None]
    end = max(x[-1] if x else 0, 10)
    low, high = bounds(y, [level[1] for level in shown])
    return {
        'animation': False, 'textStyle': {'fontFamily': 'inherit'},
        'grid': {'left': 46, 'right': 12, 'top': 30, 'bottom': 36},
        'legend': {'top': 0, 'left': 8, 'icon': 'roundRect', 'itemWidth': 16, 'itemHeight': 4,
                   'textStyle': {'color': GREY}, 'selectedMode': False,
                   'data': ['learner', *(_name(*level[:2]) for level in shown)]},
        'tooltip': {'trigger': 'axis', ':valueFormatter': '(value) => value.toFixed(2)'},
        'xAxis': _axis('iteration', 1, end, 'middle', 24, False),
        'yAxis': _axis('', low, high, 'end', 0, True),
        'series': [
            _line('each', list(zip(x, y)), BLUE, width=1, opacity=0.5),
            _line('learner', list(zip(x, running_mean(y))), BLUE, width=2.5),
            *(_line(_name(name, value), [(1, value), (end, value)], colour, dash=dash, z=1)
              for name, value, colour, dash in shown)]}


def bounds(returns, levels):
    """
    Return (low, high) of the axis of the returns.

    The first iterations, and a mentor that never arrives, can earn so little that what follows
    would look flat: below twice the span of what was learned, the picture is cut.
    """
    high = max([*returns, *levels], default=1.0)
    worst = max(len(returns) // 20, int(len(returns) >= 5))
    learned = sorted(returns)[worst:] or levels or [0.0]
    low = min(learned)
    low = min([low, *(level for level in levels if level >= low - 2 * (high - low))])
    margin = 0.06 * (high - low) or 1.0
    return float(np.floor(low - margin)), float(np.ceil(high + margin))


def running_mean(values):
    """Mean over a window that is centred, and cut at both ends, as in session/pictures."""
    reach = min(WINDOW, len(values) // 8) // 2
    windows = (values[max(0, i - reach):i + reach + 1] for i in range(len(values)))
    return [sum(window) / len(window) for window in windows]


def _name(name, value):
    return f'{name} {value:.2f}'


def _axis(name, low, high, place, gap, lines):
    return {'type': 'value', 'minInterval': 1, 'min': low, 'max': high,
            'name': name, 'nameLocation': place, 'nameGap': gap,
            'nameTextStyle': {'color': GREY}, 'axisLabel': {'color': GREY},
            'axisLine': {'show': not lines, 'onZero': False, 'lineStyle': {'color': GREY}},
            'splitLine': {'show': lines, 'lineStyle': {'color': GREY, 'opacity': 0.2}}}


def _line(name, points, colour, width=1.5, opacity=1.0, dash='solid', z=2):
    return {'type': 'line', 'name': name, 'data': [list(point) for point in points], 'z': z,
            'showSymbol': False, 'clip': True, 'itemStyle': {'color': colour},
            'lineStyle': {'color': colour, 'width': width, 'opacity': opacity, 'type': dash}}
