# SPDX-License-Identifier: Apache-2.0
"""The page of results: tables against the published runs, and every figure with its verdict."""

from pathlib import Path
import shutil

from comply_ros.experiments.report_tables import tables_of
from comply_ros.experiments.report_text import DIFFERENCES, INTRODUCTION
from comply_ros.storage.file_system import atomic_write
from comply_ros.storage.run_files import OutputError


def write_page(path, numbers, figures, pictures):
    """
    Write the page to a Markdown file, aside, then rename it.

    path: of the file; pictures that are elsewhere are copied into a folder beside it that has
    the page's name. numbers: as in `results.json`. pictures: the folder of the drawn figures.

    Raises
    ------
    OutputError: if it cannot be written.

    """
    path = Path(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        folder = _beside(path, figures, pictures)
        with atomic_write(path) as part:
            part.write_text('\n'.join(page_lines(numbers, figures, folder)) + '\n')
    except OSError as error:
        raise OutputError(f'a page must be writable, got {str(path)!r} '
                          f'({error.strerror.lower()})') from None


def _beside(path, figures, pictures):
    """Return the folder of the pictures, relative to the page."""
    if pictures.parent.resolve() == path.parent.resolve():
        return pictures.name
    folder = path.with_suffix('')
    folder.mkdir(exist_ok=True)
    for figure in figures:
        if figure.kind == 'table':
            continue
        shutil.copyfile(pictures / f'{figure.name}.png', folder / f'{figure.name}.png')
    return folder.name


def page_lines(numbers, figures, folder):
    """Yield the lines of the page."""
    verdicts = [each['agrees'] for each in numbers['figures'].values() if 'agrees' in each]
    yield INTRODUCTION.format(**{key: numbers[key] for key in ('profile', 'seeds')},
                              agree=sum(verdicts), all=len(verdicts), command=command(numbers))
    yield from tables_of(numbers)
    yield DIFFERENCES
    for title, of_report in (('The figures of the report', True), ('Beyond the report', False)):
        chosen = [each for each in figures
                  if each.name[0].isdigit() == of_report and each.kind != 'table']
        if chosen:
            yield f'\n## {title}\n'
        for figure in chosen:
            yield from figure_lines(figure, numbers['figures'][figure.name], folder)


def command(numbers):
    """Return the command that writes this page again."""
    words = ['scripts/run reproduce', f'--profile {numbers["profile"]}',
             f'--seeds {numbers["seeds"]}']
    if numbers['mentor_specs'][1].startswith('file:'):
        words.append('--mentors DIR')
    return ' '.join(words)


def figure_lines(figure, told, folder):
    """Yield the lines of one figure: picture, what the report's shows, whether ours agrees."""
    name = f'Figure {figure.name}' if figure.name[0].isdigit() else figure.title
    yield f'\n### {name}\n\n![{figure.title}]({folder}/{figure.name}.png)\n'
    if not figure.name[0].isdigit():
        yield f'{figure.showed[0].upper()}{figure.showed[1:]}.'
        return
    if 'agrees' not in told:
        yield f'The report: {figure.showed}. Ours is drawn from the same definition.'
        return
    yield (f'The report: {figure.showed}. '
           f'{"Ours agrees" if told["agrees"] else "**Ours does not**"}: {told["evidence"]}.')
