# SPDX-License-Identifier: Apache-2.0
"""`sweep` from its command line: continued, killed, on a full disk, and on a cluster."""

import csv
import os
from pathlib import Path
import resource
import signal
import socket
import subprocess
import sys
import time

from PIL import Image
import pytest
from waiting import DEADLINE

from comply_ros.experiments import sweep
from comply_ros.experiments.train_api import train
from comply_ros.experiments.training_runs import learn, Run

FILE = """
map: bar_grid
methods: [beta_implicit, explicit]
mentors: [optimal, 'noisy:0.2']
settings: {temperature: [0.5, 1.0], iterations: ITERATIONS, episodes: 2}
seeds: SEEDS
"""
START = (sys.executable, '-c',
         'import sys; from comply_ros.executables import sweep; sys.exit(sweep())')


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """Stand in an empty folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def written(seeds=3, iterations=2, name='a.yaml'):
    """Write a sweep of 8 runs a seed, and return its name."""
    Path(name).write_text(
        FILE.replace('SEEDS', str(seeds)).replace('ITERATIONS', str(iterations)))
    return name


def run(*argv):
    """Sweep, and return the exit code."""
    return sweep.main(['sweep', *argv])


def rows(path):
    """Return the rows of a table, in the order of their text."""
    with open(path, newline='') as file:
        return sorted(map(tuple, csv.reader(file)))


def started(*argv, **options):
    """Start a sweep as a process."""
    return subprocess.Popen([*START, *argv], stderr=subprocess.PIPE, text=True, **options)


def wait_for_rows(path, count, process):
    """Return when a table has so many rows."""
    deadline = time.monotonic() + DEADLINE
    while not (os.path.exists(path) and Path(path).read_text().count('\n') > count):
        assert time.monotonic() < deadline and process.poll() is None
        time.sleep(0.01)


def test_a_sweep_is_one_tidy_table(capsys):
    assert run(written()) == 0
    with open('runs/a.csv', newline='') as file:
        table = list(csv.DictReader(file))
    assert list(table[0]) == (
        'map profile mentor mentor_seed budget advising method temperature iterations episodes '
        'seed steps time_to_convergence reward_ratio regret final_return mentor_return '
        'optimal_return digest').split()
    assert len({tuple(row[name] for name in ('method', 'mentor', 'temperature', 'seed'))
                for row in table}) == len(table) == 24
    one = next(row for row in table if (row['method'], row['mentor'], row['seed'],
                                        row['temperature']) == ('explicit', 'optimal', '2', '0.5'))
    settings = (('temperature', 0.5), ('iterations', 2), ('episodes', 2))
    assert one['digest'] == learn(Run('bar_grid', method='explicit', mentor='optimal', seed=2,
                                      settings=settings)).digest
    assert capsys.readouterr().out.endswith('runs/a.csv: 24 runs, 24 of them new\n')


def test_an_environment_without_a_table_is_swept_without_what_needs_a_model(capsys):
    pytest.importorskip('gymnasium')
    name = 'gym:MountainCar-v0?bins=8'
    Path('a.yaml').write_text(f"map: ['{name}', bar_grid]\nmethods: beta_implicit\n"
                              'mentors: random\nsettings: {iterations: 1, episodes: 1}\nseeds: 2')
    assert run('a.yaml') == run('a.yaml') == 0
    with open('runs/a.csv', newline='') as file:
        table = [row for row in csv.DictReader(file) if row['map'] == name]
    assert sorted(row['digest'] for row in table) == sorted(
        train(name, mentor='random', iterations=1, episodes=1, seed=seed).digest
        for seed in (0, 1))
    missing = ('time_to_convergence', 'reward_ratio', 'regret', 'mentor_return', 'optimal_return')
    assert {row[each] for row in table for each in missing} == {''}
    assert capsys.readouterr().out.count(
        f'{name} has no model: its runs have no {", ".join(missing)}\n') == 2


def test_runs_in_the_table_are_not_repeated(capsys, monkeypatch):
    run(written(seeds=2))
    before = Path('runs/a.csv').read_text()
    assert run(written(seeds=3)) == 0
    assert Path('runs/a.csv').read_text().startswith(before)
    monkeypatch.setattr('comply_ros.experiments.parallel_runs.completed', None)
    assert run(written(seeds=3)) == 0
    assert capsys.readouterr().out.endswith('runs/a.csv: 24 runs, 0 of them new\n')


def test_a_killed_sweep_is_continued_without_losing_or_repeating_a_run():
    name = written(seeds=50, iterations=4)
    for count in (20, 150):
        process = started(name)
        wait_for_rows('runs/a.csv', count, process)
        process.kill()
        process.communicate()
    kept = Path('runs/a.csv').read_text()
    kept = kept[:kept.rindex('\n') + 1]
    with open('runs/a.csv', 'a') as file:
        file.write('bar_grid,published,opt')
    assert 150 < kept.count('\n') < 400
    assert run(name) == 0
    assert run(name, '--out', 'undisturbed.csv') == 0
    assert Path('runs/a.csv').read_text().startswith(kept)
    assert rows('runs/a.csv') == rows('undisturbed.csv')
    assert len(rows('runs/a.csv')) == 1 + 400


def test_ctrl_c_keeps_completed_runs():
    process = started(written(seeds=10, iterations=20_000))
    wait_for_rows('runs/a.csv', 1, process)
    process.send_signal(signal.SIGINT)
    err = process.communicate(timeout=DEADLINE)[1]
    done = len(rows('runs/a.csv')) - 1
    assert process.returncode == 130
    assert err.splitlines()[-1] == (f'sweep: interrupted; {done} of 80 runs are kept in '
                                    'runs/a.csv, and the same command continues from there')
    assert 'Traceback' not in err


@pytest.mark.long
def test_a_full_disk_keeps_completed_runs():
    limit = 5000

    def limit_file_size():
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, resource.RLIM_INFINITY))
    process = started(written(), preexec_fn=limit_file_size)
    err = process.communicate(timeout=DEADLINE)[1]
    text = Path('runs/a.csv').read_text()
    done = text.count('\n') - 1
    assert process.returncode == 1
    assert err.splitlines()[-1] == (f'sweep: runs/a.csv: file too large; {done} of 24 runs '
                                    'are kept in runs/a.csv, and the same command continues '
                                    'from there')
    assert 5 < done < 24 and limit - 400 < len(text) <= limit and text.endswith('\n')
    assert run('a.yaml') == 0
    assert len(rows('runs/a.csv')) == 25


def test_a_full_disk_at_once_is_one_sentence(capsys):
    Path('full.csv').symlink_to('/dev/full')
    assert run(written(), '--out', 'full.csv') == 1
    assert capsys.readouterr().err == 'sweep: full.csv: no space left on device\n'


@pytest.mark.long
def test_a_table_of_another_map_or_mentor_of_the_same_name_is_an_error(capsys):
    Path('mine.txt').write_text('>>G\n')
    Path('mine.yaml').write_text(OTHER_MAP.replace('ROW', '..G'))
    Path('a.yaml').write_text(FILE.replace('bar_grid', 'mine.yaml').replace(
        'optimal', "'file:mine.txt'").replace('SEEDS', '2').replace('ITERATIONS', '2'))
    subprocess.run([*START, 'a.yaml'], check=True)
    before = Path('runs/a.csv').read_text()
    for name, content, what in (('mine.txt', '><G\n', 'mentor'),
                                ('mine.yaml', OTHER_MAP.replace('ROW', '..G').replace(
                                    '0.9', '0.8'), 'map')):
        Path(name).write_text(content)
        done = subprocess.run([*START, 'a.yaml'], check=False, capture_output=True, text=True)
        assert done.returncode == 2
        assert f'the {what} of a run must be that of the sweep' in done.stderr
        assert done.stderr.count('\n') == 1 and Path('runs/a.csv').read_text() == before


def test_a_table_of_another_sweep_is_an_error(capsys):
    run(written())
    before = Path('runs/a.csv').read_text()
    capsys.readouterr()
    assert run(written(seeds='[0, 1]')) == 2
    err = capsys.readouterr().err
    assert err.startswith('sweep: runs/a.csv, line ')
    assert 'every run of the table must be one of the sweep, got bar_grid, published, ' in err
    assert err.count('\n') == 1
    Path('a.yaml').write_text(Path('a.yaml').read_text().replace('temperature', 'discount'))
    assert run('a.yaml') == 2
    assert 'sweep: runs/a.csv: its first line must be map, ' in capsys.readouterr().err
    assert Path('runs/a.csv').read_text() == before


@pytest.mark.parametrize('argv, message', [
    (['nowhere.yaml'], "a sweep file must be readable, got 'nowhere.yaml' (no such file or direc"),
    (['bad.yaml'], "bad.yaml, line 3: did you mean 'explicit'? a method must be one of "),
    (['a.yaml', '--workers', '0'], 'workers must be at least 1, got 0'),
    (['a.yaml', '--workers', '2', '--scheduler', 'x'], '--workers is for this machine'),
    (['a.yaml', '--out', 'a.parquet'], "a table must be a file that ends in .csv, got 'a.parq")])
def test_a_mistake_is_one_line_and_exit_code_2(capsys, argv, message):
    Path('bad.yaml').write_text(Path(written()).read_text().replace('explicit', 'explict'))
    assert run(*argv) == 2
    err = capsys.readouterr().err
    assert err.startswith(f'sweep: {message}')
    assert err.count('\n') == 1


@pytest.mark.long
def test_memory_stays_flat():
    process = started(written(seeds=250, iterations=1))
    wait_for_rows('runs/a.csv', 500, process)
    before = memory(process.pid)
    wait_for_rows('runs/a.csv', 1950, process)
    assert memory(process.pid) - before < 10
    assert process.wait() == 0
    process.stderr.close()


def memory(pid):
    """Return the resident memory of a process, in MB."""
    line = next(line for line in Path(f'/proc/{pid}/status').read_text().splitlines()
                if line.startswith('VmRSS'))
    return int(line.split()[1]) / 1024


@pytest.fixture(scope='module')
def scheduler():
    """Address of a Dask scheduler with two workers, all processes of this machine."""
    from distributed import LocalCluster
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address='127.0.0.1:0',
                      silence_logs=50) as cluster:
        yield cluster.scheduler_address


def test_a_cluster_makes_the_same_table(scheduler):
    assert run(written(), '--scheduler', scheduler, '--out', 'far.csv') == 0
    assert run(written(), '--out', 'near.csv') == 0
    assert rows('far.csv') == rows('near.csv')


OTHER_MAP = """{intended: 0.9, step_limit: 40, rewards: {step: -1, goal: 9},
starts: anywhere, rows: [ROW]}"""


@pytest.mark.long
def test_workers_in_another_folder_learn_in_the_map_of_the_sweep(
        scheduler, tmp_path, monkeypatch):
    """The workers stand in another folder, with other files of the same names, or with none."""
    from distributed import Client
    names, elsewhere = ('mine.yaml', 'mine.txt', 'seen.npz'), tmp_path / 'elsewhere'
    elsewhere.mkdir()
    with Client(scheduler) as client:
        client.run(os.chdir, str(elsewhere))
    for number, (row, policy, exists) in enumerate((('..G', '>>G', True), ('G..', 'G<<', False))):
        here = tmp_path / str(number)  # the second sweep has other files of the same names
        here.mkdir()
        monkeypatch.chdir(here)
        Path('mine.yaml').write_text(OTHER_MAP.replace('ROW', row))
        Path('mine.txt').write_text(f'{policy}\n')
        result = train(map='mine.yaml', mentor='none', method='sarsa', iterations=3)
        result.save('out')
        Path('out/learning.npz').rename('seen.npz')
        for name in names:
            other = elsewhere / name
            other.write_text(OTHER_MAP.replace('ROW', '...G')) if exists \
                else other.unlink(missing_ok=True)
        Path('a.yaml').write_text(FILE.replace('map: bar_grid', 'map: [mine.yaml, bar_grid]')
                                  .replace('[optimal,', '[optimal, random, none,')
                                  .replace('SEEDS', '2').replace('ITERATIONS', '2'))
        Path('b.yaml').write_text(FILE.replace('bar_grid', 'mine.yaml').replace(
            '[optimal,', "['file:mine.txt', 'file:mine.txt@0.5', 'learned:seen.npz',")
            .replace('SEEDS', '2').replace('ITERATIONS', '2'))
        for name in 'ab':
            for argv in ('--out', f'near-{name}.csv'), (
                    '--scheduler', scheduler, '--out', f'far-{name}.csv'):
                subprocess.run([*START, f'{name}.yaml', *argv], check=True)
            assert rows(f'far-{name}.csv') == rows(f'near-{name}.csv')


@pytest.mark.long
def test_a_cluster_gets_the_image_of_a_map_of_nav2(scheduler, tmp_path):
    """The workers stand in another folder: neither of the files is there."""
    from distributed import Client
    (tmp_path / 'elsewhere').mkdir()
    with Client(scheduler) as client:
        client.run(os.chdir, str(tmp_path / 'elsewhere'))
    Image.new('L', (4, 4), 254).save('house.png')
    Path('house.yaml').write_text(
        '{image: house.png, resolution: 0.5, origin: [0, 0, 0], negate: 0, '
        'occupied_thresh: 0.65, free_thresh: 0.25}')
    Path(written(seeds=1)).write_text(Path('a.yaml').read_text().replace(
        'bar_grid', "'nav2:house.yaml?start=0.25,0.25&goal=1.75,1.75&cell_size=0.5'"))
    assert run('a.yaml', '--scheduler', scheduler, '--out', 'far.csv') == 0
    assert run('a.yaml', '--out', 'near.csv') == 0
    assert rows('far.csv') == rows('near.csv')


@pytest.mark.long
def test_ctrl_c_ends_a_sweep_on_a_cluster(scheduler):
    name = written(seeds=10, iterations=3000)
    process = started(name, '--scheduler', scheduler)
    wait_for_rows('runs/a.csv', 2, process)
    process.send_signal(signal.SIGINT)
    err = process.communicate(timeout=DEADLINE)[1]
    assert process.returncode == 130
    assert err.splitlines()[-1].startswith('sweep: interrupted; ')
    assert 'Traceback' not in err


@pytest.mark.long
def test_a_lost_cluster_is_one_sentence():
    from distributed import LocalCluster
    with LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address='127.0.0.1:0',
                      silence_logs=50) as cluster:
        address = cluster.scheduler_address
        process = started(written(seeds=10, iterations=3000), '--scheduler', address)
        wait_for_rows('runs/a.csv', 2, process)
    err = process.communicate(timeout=DEADLINE)[1]
    assert process.returncode == 1
    assert f'sweep: the cluster at {address} was lost; ' in err.splitlines()[-1]
    assert 'Traceback' not in err


@pytest.mark.parametrize('listens', [False, True])
@pytest.mark.long
def test_a_scheduler_that_does_not_answer_is_one_sentence(capsys, monkeypatch, listens):
    monkeypatch.setattr('comply_ros.experiments.parallel_runs.CONNECT_TIMEOUT', 1)
    with socket.socket() as silent:
        silent.bind(('127.0.0.1', 0))
        if listens:
            silent.listen()
        address = f'tcp://127.0.0.1:{silent.getsockname()[1]}'
        start = time.monotonic()
        assert run(written(), '--scheduler', address) == 1
        assert time.monotonic() - start < 10
    assert capsys.readouterr().err == (
        f"sweep: a Dask scheduler must answer within 1 s, and none does at '{address}'\n")


def test_dask_is_not_imported_without_a_scheduler():
    code = ('import sys; import comply_ros.experiments.sweep;'
            'sys.exit(bool({"dask", "distributed"} & set(sys.modules)))')
    assert subprocess.run([sys.executable, '-c', code], check=False).returncode == 0
