# SPDX-License-Identifier: Apache-2.0
"""Colors and places of several mentors."""

import pytest

from comply_ros.plots.mentor_marks import (
    FAINTEST,
    mentor_color,
    MENTOR_COLORS,
    mentor_spots,
    opacity,
    Spot,
)
from comply_ros.plots.trust_colors import TRUST_ANCHORS


def test_no_mentor_has_the_color_of_another_or_of_a_confidence():
    colors = {mentor_color(m).lower() for m in range(len(MENTOR_COLORS))}
    assert len(colors) == len(MENTOR_COLORS)
    assert not colors & {anchor.lower() for anchor in TRUST_ANCHORS}
    assert mentor_color(len(MENTOR_COLORS)) == mentor_color(0)


def test_two_mentors_share_a_cell_side_by_side_and_three_in_two_rows():
    assert mentor_spots(1) == [Spot(0.0, 0.0, 1.0)]
    assert mentor_spots(2) == [Spot(-0.25, 0.0, 0.5), Spot(0.25, 0.0, 0.5)]
    assert mentor_spots(3) == [Spot(-0.25, 0.25, 0.5), Spot(0.25, 0.25, 0.5),
                               Spot(-0.25, -0.25, 0.5)]


@pytest.mark.parametrize('count', [2, 5, 16])
def test_every_spot_lies_in_the_cell_and_over_no_other(count):
    spots = mentor_spots(count)
    for spot in spots:
        assert abs(spot.right) + spot.size / 2 <= 0.5 + 1e-9 >= abs(spot.up) + spot.size / 2
    for m, one in enumerate(spots):
        for other in spots[:m]:
            assert max(abs(one.right - other.right), abs(one.up - other.up)) >= one.size - 1e-9


def test_advice_is_the_fainter_the_less_it_is_trusted_but_can_always_be_seen():
    assert [opacity(confidence) for confidence in (0.0, 0.5, 1.0)] == [FAINTEST, 0.625, 1.0]
