# SPDX-License-Identifier: Apache-2.0
"""A change of the sources that changes no bits leaves all that was stored readable."""

from pathlib import Path
import shutil
import subprocess
import sys

from stored_files import SPEC, store, world

import comply_ros
from comply_ros.storage import mentor_cache
from comply_ros.storage.kernel_cache import kernel_hash
from comply_ros.storage.mentor_cache import is_slow, mentor_policy

SUPPORT = Path(__file__).parents[1] / 'support'
READER = """
import sys
import comply_ros
from comply_ros.storage.kernel_cache import kernel_hash
from stored_files import Entry, RUN, SPEC, stored, world
print(comply_ros.__file__, kernel_hash(), *stored(sys.argv[1]))
"""


def test_a_changed_comment_in_every_source_leaves_all_that_was_stored_readable(
        tmp_path, monkeypatch):
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path / 'cache'))
    store(tmp_path)
    copy = tmp_path / 'other' / 'comply_ros'
    shutil.copytree(Path(comply_ros.__file__).parent, copy)
    for path in copy.rglob('*.py'):
        path.write_text(path.read_text() + '\n# A changed comment.\n')
    init = copy / '__init__.py'
    assert comply_ros.__version__ in init.read_text()
    init.write_text(init.read_text().replace(comply_ros.__version__, '99.0.0'))
    monkeypatch.setenv('PYTHONPATH', f'{copy.parent}:{SUPPORT}')
    done = subprocess.run([sys.executable, '-c', READER, str(tmp_path)], check=False,
                          capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    file, other_hash, *read = done.stdout.split()
    assert file == str(init) and other_hash != kernel_hash()
    assert read == ['7', '8', 'True', 'True']


def test_a_mentor_of_another_version_is_made_anew(tmp_path, monkeypatch):
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path))
    mentor_policy(SPEC, world(), 0)
    assert not is_slow(SPEC, world(), 0)
    for name in ('FORMAT_VERSION', 'ALGORITHM_VERSION'):
        with monkeypatch.context() as patched:
            patched.setattr(mentor_cache, name, 99)
            assert is_slow(SPEC, world(), 0)
