# SPDX-License-Identifier: Apache-2.0
"""Which worlds the suite has, which were held out, and what is run in them."""

import pytest

from comply_ros.experiments.suite_runs import (
    ablation_runs,
    mountain_car_runs,
    suite_run,
    suite_worlds,
    SuiteWorld,
)
from comply_ros.experiments.training_runs import (
    advice_of,
    config_of,
    MENTOR_OF_SEED,
    reference_returns_of,
    Run,
    run_of_seed,
    validate_run,
)


def test_every_second_map_that_nothing_was_chosen_on_and_the_later_garnets_are_held_out():
    worlds = suite_worlds()
    held_out = [world.map for world in worlds if world.held_out]
    assert held_out == [
        'free_grid', 'maze_as_run', *(f'garnet:{seed}' for seed in range(10, 20) if seed != 15)]
    assert len(worlds) == 12 + 20
    assert [world.map for world in worlds if not world.held_out][:10] == [
        'bar_grid', 'cliff_walking', 'four_rooms', 'frozen_lake', 'frozen_lake_8x8', 'maze',
        'racetrack', 'stochastic_windy', 'taxi', 'windy']


def test_a_world_has_the_method_with_each_mentor_and_the_others_alone():
    runs = SuiteWorld('bar_grid', False).runs('published')
    assert {name: (run.method, run.mentor) for name, run in runs.items()} == {
        **{mentor: ('model_based', mentor) for mentor in (
            'none', 'optimal', 'noisy:0.3', 'snapshot:0.75', 'random', 'adversarial')},
        **{method: (method, 'none') for method in ('q_learning', 'watkins', 'sarsa_lambda')}}


@pytest.mark.parametrize('mentor, mentor_seed', [('noisy:0.3', 2), ('optimal', 0)])
def test_a_mentor_that_is_drawn_is_another_one_for_each_seed(mentor, mentor_seed):
    run = run_of_seed(suite_run('bar_grid', 'published', 'model_based', mentor), 2)
    assert (run.seed, run.mentor_seed) == (2, mentor_seed)
    assert run_of_seed(Run(mentor_seed=3), 2).mentor_seed == 3


def test_a_cell_without_a_seed_has_no_mentor_by_mistake():
    run = suite_run('bar_grid', 'published', 'model_based', 'random')
    assert run.mentor_seed == MENTOR_OF_SEED
    with pytest.raises(ValueError, match='non-negative'):
        advice_of(run)


def test_an_ablation_changes_one_part_in_a_maze_with_its_slips(tmp_path):
    runs = ablation_runs('published', tmp_path)
    for run in runs.values():
        validate_run(run)
    whole, without = (config_of(runs[0.7, part, 'optimal'])
                      for part in ('model_based', 'only the error of samples'))
    assert (whole.advice_slack, without.advice_slack) == (0.12, 0.0)
    worlds = {intended: reference_returns_of(runs[intended, 'model_based', 'none']).world
              for intended in (0.95, 0.7)}
    assert worlds[0.95].sha256 == reference_returns_of(Run('maze')).world.sha256
    assert worlds[0.7].grid.intended == 0.7


def test_a_mentor_that_is_not_heard_is_run_once(tmp_path):
    mentors = [mentor for _, part, mentor in ablation_runs('published', tmp_path)
               if part == 'the mentor is not heard']
    assert mentors == ['none', 'none']  # at each probability


def test_the_mentor_of_the_car_pushes_the_way_that_it_moves(tmp_path):
    pytest.importorskip('gymnasium')
    runs = mountain_car_runs('published', tmp_path)
    advice = advice_of(runs['swing']).reshape(20, 20)  # [position, velocity]
    assert (advice[:, :10] == 0).all()  # velocities below 0: to the left
    assert (advice[:, 10:] == 2).all()
    assert (runs['watkins'].method, runs['watkins'].mentor) == ('watkins', 'none')
