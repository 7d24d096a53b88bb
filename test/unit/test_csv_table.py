# SPDX-License-Identifier: Apache-2.0
"""A table that grows row by row: it has only whole rows, and other files stay unchanged."""

import errno

import pytest

from comply_ros.experiments.csv_table import CsvTable, TableError
from comply_ros.storage.run_files import OutputError

COLUMNS = ('method', 'seed', 'regret')


def filled(path, *rows):
    """Append rows to a table and return what is in the file."""
    with CsvTable(path, COLUMNS) as table:
        for row in rows:
            table.append(dict(zip(COLUMNS, row)))
    return path.read_text()


def test_rows_are_in_the_file_at_once(tmp_path):
    path = tmp_path / 'new' / 'runs.csv'
    with CsvTable(path, COLUMNS) as table:
        assert path.read_text() == 'method,seed,regret\n'
        table.append({'regret': 0.1, 'method': 'a,b', 'seed': 1})
        table.append({'method': 'c', 'seed': 2, 'regret': None})
        assert path.read_text() == 'method,seed,regret\n"a,b",1,0.1\nc,2,\n'
        assert list(table.rows()) == [(2, {'method': 'a,b', 'seed': '1', 'regret': '0.1'}),
                                      (3, {'method': 'c', 'seed': '2', 'regret': ''})]


def test_a_table_is_continued(tmp_path):
    path = tmp_path / 'runs.csv'
    filled(path, ('a', 1, 0.5))
    assert filled(path, ('b', 2, 0.25)) == 'method,seed,regret\na,1,0.5\nb,2,0.25\n'


@pytest.mark.parametrize('cut', range(1, len('b,2,0.25\n')))
def test_an_incomplete_last_line_is_cut_off(tmp_path, cut):
    path = tmp_path / 'runs.csv'
    whole = filled(path, ('a', 1, 0.5), ('b', 2, 0.25))
    path.write_text(whole[:-cut])
    assert filled(path, ('c', 3, 0)) == 'method,seed,regret\na,1,0.5\nc,3,0\n'


@pytest.mark.parametrize('begun', ['', 'm', 'method,seed,regret'])
def test_an_incomplete_header_is_written_again(tmp_path, begun):
    (tmp_path / 'runs.csv').write_text(begun)
    assert filled(tmp_path / 'runs.csv') == 'method,seed,regret\n'


@pytest.mark.parametrize('content', ['name,seed\nx,1', 'a letter to somebody', 'a\nb\nc'])
def test_another_file_is_an_error_and_stays_unchanged(tmp_path, content):
    path = tmp_path / 'runs.csv'
    path.write_text(content)
    with pytest.raises(TableError) as caught:
        filled(path)
    assert str(caught.value) == (f'{path}: its first line must be method, seed, regret, '
                                 f'got {", ".join(content.splitlines()[0].split(","))}')
    assert path.read_text() == content


def test_a_row_of_another_width_is_an_error(tmp_path):
    path = tmp_path / 'runs.csv'
    path.write_text('method,seed,regret\na,1,0.5\nb,2\n')
    with CsvTable(path, COLUMNS) as table, pytest.raises(TableError) as caught:
        list(table.rows())
    assert str(caught.value) == f'{path}, line 3: a row must have 3 values, got 2'


def test_a_table_has_one_writer(tmp_path):
    path = tmp_path / 'runs.csv'
    with CsvTable(path, COLUMNS), pytest.raises(TableError, match='must have one writer'):
        CsvTable(path, COLUMNS)
    filled(path)


@pytest.mark.parametrize('name, rule', [
    ('runs.parquet', 'a table must be a file that ends in .csv, got '),
    ('file/runs.csv', 'an output folder must be writable, got '),
    ('folder.csv', 'a table must be writable, got ')])
def test_a_path_that_cannot_be_a_table_is_an_error(tmp_path, name, rule):
    (tmp_path / 'file').write_text('')
    (tmp_path / 'folder.csv').mkdir()
    with pytest.raises(OutputError, match=rule):
        CsvTable(tmp_path / name, COLUMNS)


def test_an_error_of_a_full_disk_names_the_file(tmp_path):
    path = tmp_path / 'runs.csv'
    path.symlink_to('/dev/full')
    with pytest.raises(OSError) as caught:
        CsvTable(path, COLUMNS)
    assert (caught.value.errno, caught.value.filename) == (errno.ENOSPC, str(path))


def test_the_end_of_a_long_table_is_found(tmp_path):
    path = tmp_path / 'runs.csv'
    text = filled(path, *(('a', k, 0.5) for k in range(3000)))
    path.write_text(text + 'x' * 20_000)
    assert filled(path) == text


@pytest.mark.parametrize('saved', [
    lambda text: '\ufeff' + text, lambda text: text.replace('\n', '\r\n'),
    lambda text: '\ufeff' + text.replace('\n', '\r\n')], ids=['mark', 'CRLF', 'both'])
def test_a_table_that_another_program_saved_is_continued(tmp_path, saved):
    path = tmp_path / 'runs.csv'
    path.write_bytes(saved(filled(path, ('ä', 1, 0.5))).encode())
    with CsvTable(path, COLUMNS) as table:
        table.append({'method': 'b', 'seed': 2, 'regret': 0.25})
        assert list(table.rows()) == [(2, {'method': 'ä', 'seed': '1', 'regret': '0.5'}),
                                      (3, {'method': 'b', 'seed': '2', 'regret': '0.25'})]
