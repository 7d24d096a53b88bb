# SPDX-License-Identifier: Apache-2.0
"""learning.npz: read as it was written, and every other file is rejected in one sentence."""

from dataclasses import replace
import io
import json

from bar_grid_training import use_shared_code
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as st_numpy
import numpy as np
import pytest
from tiny_worlds import corridor, room

from comply_ros.learner.agent import no_advice
from comply_ros.learner.learner_config import LearnerConfig
from comply_ros.learner.learning_result import LearningError
from comply_ros.learner.presets import METHODS
from comply_ros.learner.training import Training
from comply_ros.mentor.mentor_spec import MentorError
from comply_ros.mentor.policy_validation import PolicyError
from comply_ros.storage.learning_file import read_learning, save_learning
from comply_ros.storage.mentor_cache import mentor_policy, read_mentor_spec
from comply_ros.world.grid import UP
from examples import examples

ROOM = room()
LONGEST = 400  # characters of a message
fuzz = examples(100)


def trained(method='beta_implicit'):
    """Return a short training in the room with a mentor that says up."""
    advice = no_advice(ROOM)
    advice[:6] = UP
    training = Training(ROOM, advice, replace(METHODS['report'][method], iterations=3), seed=1)
    for _ in range(3):
        training.iterate()
    return training


def written(path, **changes):
    """Return a path with a file of a training, some of whose arrays are others; None: missing."""
    save_learning(path, trained().learned())
    with np.load(path) as file:
        arrays = {**file, **changes}
    np.savez(path, **{name: array for name, array in arrays.items() if array is not None})
    return path


@pytest.mark.parametrize('method', METHODS['report'])
def test_a_learning_is_read_as_it_was_written(tmp_path, monkeypatch, method):
    use_shared_code(monkeypatch, METHODS['report'][method])
    learned = trained(method).learned()
    save_learning(tmp_path / 'a.npz', learned)
    read = read_learning(tmp_path / 'a.npz')
    assert (read.world, read.config) == (ROOM.grid.sha256, learned.config)
    assert read.state.digest() == learned.state.digest()
    for name in ('advice', 'policy', 'confidence'):
        assert (getattr(read, name) == getattr(learned, name)).all()
    read.validate(ROOM)


def test_it_can_be_a_mentor_for_its_world(tmp_path):
    save_learning(tmp_path / 'a.npz', trained().learned())
    policy = mentor_policy(read_mentor_spec(f'learned:{tmp_path}/a.npz'), ROOM, 0)
    assert (policy == trained().learned().policy).all() and (policy != -1).any()
    sparse = mentor_policy(read_mentor_spec(f'learned:{tmp_path}/a.npz@0.5'), ROOM, 0)
    assert ((sparse == policy) | (sparse == -1)).all() and (sparse != policy).any()
    with pytest.raises(PolicyError, match='was learned in another world'):
        mentor_policy(read_mentor_spec(f'learned:{tmp_path}/a.npz'), corridor(), 0)


@pytest.mark.parametrize(('changes', 'message'), [
    ({'world': None}, "it has no array 'world'"),
    ({'policy': None}, "it has no array 'policy'"),
    ({'format': np.array(99)}, 'it has format 99, and this version of comply_ros reads format'),
    ({'format': np.array('2')}, 'world and settings must be one text, and format one number'),
    ({'settings': np.array('[')}, 'its settings must be fields of a method'),
    ({'settings': np.array('{"speed": 1}')}, 'its settings must be fields of a method'),
    ({'settings': np.array('{"discount": 2.0}')}, 'discount must lie in'),
    ({'world': None, 'q': np.array(1.0), 'half_difference': None}, "no array 'world'"),
    ({'q': np.array([None])}, 'it is no .npz file, or it is damaged'),
])
def test_other_contents_are_rejected_with_the_reason(tmp_path, changes, message):
    with pytest.raises(LearningError, match='must be as comply_ros writes it, got') as error:
        read_learning(written(tmp_path / 'a.npz', **changes))
    assert message in str(error.value) and 'a.npz' in str(error.value)


def test_a_file_from_before_a_new_array_is_read(tmp_path):
    learned = read_learning(written(tmp_path / 'a.npz', half_difference=None))
    assert learned.state.digest() == trained().state.digest()
    learned.validate(ROOM)


def test_a_file_of_version_0_1_is_rejected(tmp_path):
    path = written(tmp_path / 'a.npz', advice=None, policy=None, world=None, settings=None,
                   format=None)
    with pytest.raises(LearningError, match="no array 'advice': version 0.1.0 wrote none"):
        read_learning(path)


@pytest.mark.parametrize(('name', 'message'), [
    ('missing.npz', 'no such file'), ('', 'must be read from a file'),
    ('/dev/zero', 'must be read from a file'), ('a\0b', 'no file can have this name')])
def test_a_path_that_leads_to_no_file_is_rejected(tmp_path, name, message):
    with pytest.raises(LearningError, match=message):
        read_learning(f'{tmp_path}/{name}' if name[:1] != '/' else name)


def usable(content, path):
    """Return whether bytes are a learning of the room; fail unless the message is one line."""
    path.write_bytes(content)
    try:
        learned = read_learning(path)
        learned.validate(ROOM)
    except LearningError as error:
        assert str(error).isprintable() and len(str(error)) <= LONGEST + len(str(path)), error
        with pytest.raises((MentorError, PolicyError)):
            mentor_policy(read_mentor_spec(f'learned:{path}'), ROOM, 0)
        return False
    config = replace(learned.config, iterations=1, episodes=1)
    Training(ROOM, no_advice(ROOM), config, 0, learned).iterate()  # it is of use
    return True


@pytest.fixture(scope='module')
def path(tmp_path_factory):
    """Return the path of a file that every example writes anew."""
    return tmp_path_factory.mktemp('fuzz') / 'learning.npz'


@pytest.fixture(scope='module')
def whole(tmp_path_factory):
    """Return the bytes of a file, and its arrays."""
    file = tmp_path_factory.mktemp('whole') / 'learning.npz'
    save_learning(file, trained().learned())
    with np.load(file) as arrays:
        return file.read_bytes(), dict(arrays)


@fuzz
@given(data=st.data())
def test_bytes_are_a_learning_or_an_error_of_one_line(path, whole, data):
    content, kind = bytearray(whole[0]), data.draw(st.sampled_from(['flip', 'cut', 'any']))
    if kind == 'any':
        content = data.draw(st.binary())
    elif kind == 'cut':
        content = content[:data.draw(st.integers(0, len(content)))]
    else:
        for _ in range(data.draw(st.integers(1, 4))):
            content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    usable(bytes(content), path)


@fuzz
@given(data=st.data())
def test_arrays_are_a_learning_or_an_error_of_one_line(path, whole, data):
    arrays = dict(whole[1])
    name = data.draw(st.sampled_from(sorted(arrays)))
    of_shape = st.sampled_from([arrays[name].shape, (), (0,), (1,), (9,), (9, 4), (36,)])
    dtype = st.sampled_from([arrays[name].dtype, np.dtype('f8'), np.dtype('i1'), np.dtype('U3'),
                             np.dtype('?'), np.dtype('c16')])
    arrays[name] = data.draw(st_numpy.arrays(dtype, of_shape)) if data.draw(st.booleans()) else \
        np.array(data.draw(st.sampled_from(['{}', '[]', 'null', '{"trust": []}', '[' * 9000,
                                            json.dumps({'iterations': 10 ** 400})])))
    file = io.BytesIO()
    np.savez(file, **arrays)
    usable(file.getvalue(), path)


def test_what_was_written_is_usable(path, whole):
    assert usable(whole[0], path)
    assert LearnerConfig(**json.loads(str(whole[1]['settings'])))
