# SPDX-License-Identifier: Apache-2.0
"""The variants of wind: probability, whether it blows, and the change of its strength."""

import pytest

from comply_ros.world.wind import Wind


@pytest.mark.parametrize('wind, variants', [
    (Wind((1,)), {(1.0, 0): 1.0}),
    (Wind((1,), chance=0.25), {(1.0, 0): 0.25, (0.0, 0): 0.75}),
    (Wind((1,), gusts={-1: 0.25, 2: 0.25}), {(1.0, -1): 0.25, (1.0, 2): 0.25, (1.0, 0): 0.5}),
    (Wind((1,), chance=0.5, gusts={1: 1.0}), {(1.0, 1): 0.5, (0.0, 0): 0.5}),
    (Wind((1,), chance=0.0), {(0.0, 0): 1.0}),
])
def test_the_variants_of_wind_have_probabilities_that_sum_to_1(wind, variants):
    found = {(factor, change): chance for chance, factor, change in wind.variants()}
    assert found == variants
    assert sum(found.values()) == 1.0
