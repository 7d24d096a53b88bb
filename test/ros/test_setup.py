# SPDX-License-Identifier: Apache-2.0
"""
The set-up of a clone: links, users, folders, settings of a user's shell, interruptions.

The clone has the real scripts. Its packages are one small wheel, in place of ROS 2 and colcon, so
that a set-up takes seconds; `scripts/test` itself starts in a clone that was set up in full.
"""

from collections.abc import Iterator
import json
import os
from pathlib import Path
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from zipfile import ZipFile

import pytest
from waiting import DEADLINE

TOP = Path(__file__).parents[2]
# The one of the system, if it can set up: other users may not start that of somebody's home.
SYSTEM_PYTHON = sys.executable if subprocess.run(
    ['/usr/bin/python3', '-c', 'import ensurepip, sys; assert sys.version_info[:2] >= (3, 11)'],
    capture_output=True, check=False).returncode else '/usr/bin/python3'
# What `colcon build` leaves behind as far as the scripts use it, and what it was started with.
COLCON = """
import json, os, pathlib, sys
if pathlib.Path('block').exists():
    print('blocked', file=open('blocked', 'w'))
    os.read(os.open('block', os.O_RDONLY), 1)  # a pipe
install = pathlib.Path(sys.argv[sys.argv.index('--install-base') + 1])
install.mkdir(exist_ok=True)
(install / 'local_setup.bash').write_text('export COLCON_PREFIX_PATH=/of/colcon')
(install / 'colcon.json').write_text(json.dumps([dict(os.environ), sys.argv]))
"""
FILES = {
    'colcon/__init__.py': '', 'colcon/__main__.py': COLCON, 'std_msgs/__init__.py': 'ROS = 2\n',
    'colcon-1.dist-info/METADATA': 'Metadata-Version: 2.1\nName: colcon\nVersion: 1\n',
    'colcon-1.dist-info/WHEEL': 'Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n',
}
SHOW = 'import json, os, sys; print(json.dumps([sys.prefix, dict(os.environ)]))'


def make_clone(folder: Path) -> Path:
    """Return a clone that is not set up, and whose packages need no network."""
    folder.mkdir(parents=True)
    for name in ('scripts', 'msg_defs', 'launch'):
        shutil.copytree(TOP / name, folder / name)
    (folder / 'requirements').mkdir()
    (folder / 'requirements' / 'python.txt').write_text('colcon==1\n')
    (folder / 'requirements' / 'ros.txt').write_text('')
    (folder / 'requirements' / 'test.txt').write_text('# nothing\n')
    (folder / 'wheels').mkdir()
    with ZipFile(folder / 'wheels' / 'colcon-1-py3-none-any.whl', 'w') as wheel:
        for name, text in FILES.items():
            wheel.writestr(name, text)
        record = '\n'.join(f'{name},,' for name in (*FILES, 'colcon-1.dist-info/RECORD'))
        wheel.writestr('colcon-1.dist-info/RECORD', record)
    return folder


def environment(clone: Path, **settings: str) -> dict[str, str]:
    return {'PATH': os.environ['PATH'], 'HOME': str(clone), 'PYTHON': sys.executable,
            'PIP_NO_INDEX': '1', 'PIP_FIND_LINKS': str(clone / 'wheels'), **settings}


def run(clone, *argv, cwd=None, user=None, **settings) -> subprocess.CompletedProcess:
    """Run `scripts/python`, or another command, and return it with its output."""
    return subprocess.run(
        [str(each) for each in argv] if argv and isinstance(argv[0], Path)
        else [str(clone / 'scripts' / 'python'), *argv], cwd=cwd or clone, user=user,
        capture_output=True, text=True, check=False, timeout=DEADLINE,
        env=environment(clone, **settings))


def start(clone, *argv, **settings) -> subprocess.Popen:
    return subprocess.Popen(
        [str(clone / 'scripts' / 'python'), *argv], cwd=clone, text=True, bufsize=1,
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        env=environment(clone, **settings), start_new_session=True)


def end(process: subprocess.Popen) -> None:
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGKILL)
    process.communicate(timeout=DEADLINE)


def wait_for_line(process: subprocess.Popen, text: str) -> None:
    for line in process.stderr:
        if text in line:
            return
    pytest.fail(f'{text!r} was not printed')


@pytest.fixture
def folder() -> Iterator[Path]:
    """Return a folder that other users can read, which those of pytest are not."""
    with tempfile.TemporaryDirectory(prefix='comply_ros_') as name:
        Path(name).chmod(0o755)
        yield Path(name).resolve()


@pytest.fixture(scope='module')
def finished() -> Iterator[Path]:
    """Return a clone that is set up; tests leave it so."""
    with tempfile.TemporaryDirectory(prefix='comply_ros_') as name:
        Path(name).chmod(0o755)
        clone = make_clone(Path(name).resolve() / 'clone-1.0_a+b@c~d')
        done = run(clone, '-c', SHOW, PYTHON=SYSTEM_PYTHON)
        assert done.returncode == 0, done.stderr
        assert '1/2' in done.stderr and '2/2' in done.stderr
        yield clone


@pytest.fixture
def untouched(finished):
    """Return the clone, and check that it was not set up again."""
    stamps = [finished / '.venv' / 'made-from', finished / 'install' / 'made-from']
    before = [path.stat().st_ino for path in stamps]
    yield finished
    assert [path.stat().st_ino for path in stamps] == before


def assert_uses(clone: Path, done: subprocess.CompletedProcess) -> dict[str, str]:
    """Assert that a program ran in the set-up of a clone; return its environment."""
    assert (done.returncode, done.stderr) == (0, '')
    prefix, variables = json.loads(done.stdout)
    assert prefix == str(clone / '.venv')
    return variables


def test_a_second_start_sets_up_nothing(untouched):
    assert_uses(untouched, run(untouched, '-c', SHOW))


def test_a_link_to_the_clone_is_the_clone(untouched, folder):
    (folder / 'linked').symlink_to(untouched)
    assert_uses(untouched, run(untouched, folder / 'linked' / 'scripts' / 'python', '-c', SHOW))


def test_a_link_to_a_folder_above_the_clone_is_followed(untouched, folder):
    (folder / 'above').symlink_to(untouched.parent)
    script = folder / 'above' / untouched.name / 'scripts' / 'python'
    assert_uses(untouched, run(untouched, script, '-c', SHOW, cwd=folder / 'above'))


def test_a_link_to_a_script_is_the_script(untouched, folder):
    (folder / 'my-python').symlink_to(untouched / 'scripts' / 'python')
    assert_uses(untouched, run(untouched, folder / 'my-python', '-c', SHOW, cwd=folder))


@pytest.mark.parametrize('settings', [
    {'ROS_DISTRO': 'jazzy'}, {'ROS_DISTRO': 'noetic'}, {'AMENT_PREFIX_PATH': '/opt/ros/jazzy'},
    {'ROS_DISTRO': 'jazzy', 'AMENT_PREFIX_PATH': '/nonexistent:'}],
    ids=lambda settings: ' '.join(settings.values()))
def test_a_distribution_that_is_named_but_not_sourced_changes_nothing(untouched, settings):
    assert_uses(untouched, run(untouched, '-c', SHOW, **settings))


def test_a_script_that_is_started_by_another_has_the_same_set_up(untouched):
    nested = 'import subprocess, sys; sys.exit(subprocess.run(sys.argv[1:]).returncode)'
    alone = assert_uses(untouched, run(untouched, '-c', SHOW, ROS_DISTRO='jazzy'))
    inner = assert_uses(untouched, run(
        untouched, '-c', nested, str(untouched / 'scripts' / 'python'), '-c', SHOW,
        ROS_DISTRO='jazzy'))
    assert inner == alone


@pytest.mark.parametrize('settings', [
    {'CDPATH': '/tmp:.'}, {'GLOBIGNORE': '*'}, {'POSIXLY_CORRECT': '1'}, {'PYTHONHOME': '/none'},
    {'SHELLOPTS': 'braceexpand:hashall:noclobber:noglob'}, {'BASHOPTS': 'failglob:nocasematch'},
    {'BASHOPTS': 'nullglob:dotglob'}, {'BASH_FUNC_cd%%': '() { echo changed; }'},
    {'BASH_FUNC_find%%': '() { false; }'}, {'PYTHONPLATLIBDIR': 'none'}],
    ids=lambda settings: ' '.join(map('='.join, settings.items())))
def test_settings_of_the_shell_and_of_python_change_nothing(untouched, settings):
    assert_uses(untouched, run(untouched, '-c', SHOW, **settings))


def test_a_started_program_imports_nothing_from_where_the_user_is(untouched, folder):
    (folder / 'tools').mkdir()
    (folder / 'tools' / '__init__.py').write_text('raise SystemExit("tools of the user")')
    (untouched / 'tools').mkdir(exist_ok=True)
    (untouched / 'tools' / '__main__.py').write_text('print("tools of the clone")')
    (untouched / 'tools' / '__init__.py').write_text('')
    done = run(untouched, untouched / 'scripts' / 'chaos', cwd=folder)
    assert (done.stdout, done.stderr) == ('tools of the clone\n', '')


def test_packages_of_ros_1_on_the_path_of_python_are_not_taken(untouched, folder):
    (folder / 'std_msgs').mkdir()
    (folder / 'std_msgs' / '__init__.py').write_text('ROS = 1')
    (folder / 'of_the_user.py').write_text('')
    done = run(untouched, '-c', 'import of_the_user, std_msgs; print(std_msgs.ROS)',
               PYTHONPATH=str(folder))
    assert (done.stdout, done.stderr) == ('2\n', '')


@pytest.mark.long
def test_a_set_up_is_not_changed_by_settings_of_the_user(folder):
    home = folder / 'home'
    (home / '.config' / 'pip').mkdir(parents=True)
    (home / '.config' / 'pip' / 'pip.conf').write_text(
        f'[global]\nuser = true\n[install]\ntarget = {home}/target\n')
    (home / 'random.py').write_text('raise SystemExit("random of the user")')
    clone = make_clone(folder / 'clone')
    done = run(clone, '-c', SHOW, cwd=home, **{
        'HOME': str(home), 'PIP_USER': '1', 'PIP_TARGET': str(home), 'PIP_PREFIX': str(home),
        'PIP_REQUIRE_HASHES': '1', 'PIP_ONLY_BINARY': 'none', 'PIP_DRY_RUN': '1',
        'PIP_CONSTRAINT': '/none', 'PYTHONPATH': str(home), 'PYTHONHOME': '/none',
        'PYTHONWARNINGS': 'error', 'PYTHONINSPECT': '1', 'CDPATH': '/tmp:.', 'DESTDIR': '/none',
        'COLCON_DEFAULTS_FILE': '/none', 'COLCON_LOG_PATH': '/none', 'CMAKE_GENERATOR': 'None',
        'CMAKE_PREFIX_PATH': '/opt/ros/noetic', 'MAKEFLAGS': '-n', 'CFLAGS': '-none',
        'ROS_DISTRO': 'noetic', 'BASHOPTS': 'failglob', 'LD_PRELOAD': '',
        'SHELLOPTS': 'braceexpand:hashall:noclobber:noglob', 'LC_ALL': 'C'})
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)[0] == str(clone / '.venv')
    assert not {'target', '.local', 'lib', 'colcon'} & {path.name for path in home.iterdir()}
    variables, argv = json.loads((clone / 'install' / 'colcon.json').read_text())
    assert variables['MAKEFLAGS'].startswith('-j')
    assert not {'DESTDIR', 'CMAKE_GENERATOR', 'CFLAGS', 'PYTHONPATH', 'PYTHONHOME',
                'COLCON_LOG_PATH', 'ROS_DISTRO'} & set(variables)
    assert variables['CMAKE_PREFIX_PATH'] == str(clone / '.venv')
    assert variables['COLCON_DEFAULTS_FILE'].startswith(str(clone))


@pytest.mark.long
def test_packages_that_cannot_be_installed_are_named_with_the_reason(folder):
    clone = make_clone(folder / 'clone')
    (clone / 'requirements' / 'python.txt').write_text('colcon==2\n')
    done = run(clone, '-c', SHOW)
    assert done.returncode == 2
    assert 'No matching distribution found for colcon==2' in done.stderr
    assert done.stderr.endswith(
        'comply_ros: could not install its Python packages, for the reason above; if that is the '
        'network, go online and start again.\n')


@pytest.fixture(scope='module')
def clone() -> Iterator[Path]:
    """Return a clone that was set up, for tests that change it one after the other."""
    with tempfile.TemporaryDirectory(prefix='comply_ros_') as name:
        clone = make_clone(Path(name).resolve() / 'clone')
        assert run(clone, '-c', SHOW).returncode == 0
        yield clone


@pytest.mark.long
def test_a_set_up_that_was_interrupted_is_done_again(clone):
    with (clone / 'requirements' / 'python.txt').open('a') as file:
        file.write('# changed\n')
    interrupted = start(clone, '-c', SHOW)
    wait_for_line(interrupted, '1/2')
    end(interrupted)
    (clone / 'requirements' / 'python.txt').write_text('colcon==1\n')  # as it was before
    done = run(clone, '-c', 'import colcon')
    assert done.returncode == 0, done.stderr
    assert '1/2' in done.stderr


@pytest.mark.long
def test_a_build_that_was_interrupted_is_done_again(clone):
    source = clone / 'launch' / 'teach.launch.py'
    text = source.read_bytes()
    times = source.stat()
    source.write_bytes(text + b'# changed\n')
    os.mkfifo(clone / 'block')
    interrupted = start(clone, '-c', SHOW)
    deadline = time.monotonic() + DEADLINE
    while not (clone / 'blocked').exists():  # colcon builds
        assert time.monotonic() < deadline and interrupted.poll() is None
        time.sleep(0.05)
    end(interrupted)
    (clone / 'block').unlink()
    source.write_bytes(text)
    os.utime(source, ns=(times.st_atime_ns, times.st_mtime_ns))
    done = run(clone, '-c', SHOW)
    assert done.returncode == 0, done.stderr
    assert '2/2' in done.stderr


@pytest.mark.long
def test_a_source_that_is_older_than_the_build_or_deleted_is_noticed(clone):
    source = clone / 'launch' / 'teach.launch.py'
    source.write_text('# another version, of an archive')
    os.utime(source, (1e9, 1e9))
    assert '2/2' in run(clone, '-c', SHOW).stderr
    source.unlink()
    assert '2/2' in run(clone, '-c', SHOW).stderr
    assert run(clone, '-c', SHOW).stderr == ''


@pytest.mark.long
def test_nothing_is_deleted_while_a_program_runs_from_it(clone):
    requirements, library = clone / 'requirements' / 'python.txt', clone / '.venv' / 'library.so'
    library.write_bytes(b'as loaded')
    started = start(clone, '-c', 'print("runs", flush=True); input(); import colcon; print("ran")')
    loads = ('import mmap, sys; f = open(sys.argv[1], "rb"); m = mmap.mmap(f.fileno(), 0, '
             'access=mmap.ACCESS_READ); print("runs", flush=True); input()')
    not_started = subprocess.Popen([sys.executable, '-c', loads, str(library)], text=True,
                                   stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    try:
        for running in (started, not_started):  # by a script
            assert running.stdout.readline() == 'runs\n'
        requirements.write_text(requirements.read_text() + '# changed\n')
        done = run(clone, '-c', SHOW)
        sentence, _, listed = done.stderr.partition(' (process ')
        assert (done.returncode, sentence) == (2, (
            'comply_ros: has to be set up again, since its files have changed, and something '
            f'still runs from {clone}: end it first'))
        assert set(listed.strip(')\n').split()) == {f'{started.pid}', f'{not_started.pid}'}
        output, errors = started.communicate('\n', timeout=DEADLINE)
        assert (output, errors) == ('ran\n', '')
        assert f'(process {not_started.pid})' in run(clone, '-c', SHOW).stderr
        assert library.exists()
    finally:
        not_started.communicate('\n', timeout=DEADLINE)
        end(started)
    assert '1/2' in run(clone, '-c', SHOW).stderr


@pytest.mark.long
def test_of_two_first_starts_at_the_same_time_one_sets_up(folder):
    clone = make_clone(folder / 'clone')
    both = [start(clone, '-c', SHOW) for _ in range(2)]
    try:
        errors = ''.join(each.communicate(timeout=DEADLINE)[1] for each in both)
    finally:
        for each in both:
            end(each)
    assert [each.returncode for each in both] == [0, 0], errors
    assert errors.count('1/2') == 1


@pytest.fixture
def reader(request):
    """Return a user (as of `subprocess.run`) who may not write where root has written."""
    if os.getuid() != 0:
        pytest.skip('only root can start a program as another user')
    return 65534


def test_another_user_who_may_only_read_uses_the_set_up(untouched, reader):
    variables = assert_uses(untouched, run(untouched, '-c', SHOW, user=reader, cwd='/'))
    assert variables['VIRTUAL_ENV'] == str(untouched / '.venv')


def test_another_user_is_told_whose_clone_has_to_be_set_up(folder, reader):
    clone = make_clone(folder / 'clone')
    done = run(clone, '-c', SHOW, user=reader, cwd='/')
    assert (done.returncode, done.stderr) == (2, (
        f'comply_ros: is not set up in {clone} for its present files, and you may not write '
        f'there: start a script once as its owner ({clone.owner()}), or use a clone of your '
        'own\n'))


@pytest.mark.parametrize('name', ['küche', 'my clone', 'a;b', "it's", 'a&b', 'a$b', 'a"b', 'a(b',
                                  'a#b', 'a%b', 'a:b', 'a*b', 'a[b]', 'a=b', 'a,b', 'a\\b', 'a\nb',
                                  'ａ'])
def test_a_folder_that_cannot_be_built_in_is_named_first(folder, name):
    shutil.copytree(TOP / 'scripts', folder / name / 'scripts')
    done = run(folder / name, '-c', SHOW)
    assert (done.returncode, done.stderr) == (2, (
        'comply_ros: needs a folder whose path has only the letters a to z, digits and ._-+@~ '
        f"(colcon and CMake cannot build in others), got '{folder / name}'\n"))
    assert os.listdir(folder / name) == ['scripts']


@pytest.mark.long
def test_developers_packages_are_added_once_and_on_request(clone):
    assert not list((clone / '.venv').glob('added-*'))
    script = clone / 'scripts' / 'added'
    script.write_text('#!/usr/bin/env bash\n. "$(dirname "$(readlink -f "$0")")/environment.bash"'
                      '\nadd_packages test\n')
    script.chmod(0o755)
    assert 'requirements/test.txt, once' in run(clone, script).stderr
    assert run(clone, script).stderr == ''


def test_a_checkout_that_converts_ends_of_lines_leaves_them(folder):
    if not (TOP / '.git').exists():
        pytest.skip('not a clone of git')
    subprocess.run(['git', '-c', 'core.autocrlf=true', '-c', 'advice.detachedHead=false', 'clone',
                    '--quiet', '--depth', '1', f'file://{TOP}', str(folder / 'clone')],
                   check=True, timeout=DEADLINE)
    listed = subprocess.run(['git', 'ls-files', '--eol'], cwd=folder / 'clone', check=True,
                            capture_output=True, text=True).stdout
    assert 'w/lf' in listed and 'w/crlf' not in listed and 'w/mixed' not in listed
