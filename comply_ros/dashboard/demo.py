# SPDX-License-Identifier: Apache-2.0
"""`scripts/demo`: a lesson in the maze, or one in which you are the mentor."""

import argparse

from comply_ros.nodes.lesson import lesson_parser, main_of

TEACH = '--teach'
DEFAULTS = {'iterations': '100', 'out': 'runs/demo'}


def demo_parser() -> argparse.ArgumentParser:
    """Return a parser of the options of the demo without `--teach`, which its help mentions."""
    parser = lesson_parser('demo', 'Three nodes learn the maze; three pictures show the result.',
                           **DEFAULTS)
    parser.add_argument(TEACH, action='store_true',
                        help='be the mentor yourself, on a page in the browser; it has other '
                        'options: scripts/demo --teach --help')
    return parser


def main(argv: list[str]) -> int:
    """Run the demo; return the exit code."""
    own = [each for each in argv if not means_teach(each)]
    if own == argv:
        return main_of(demo_parser(), argv)
    from comply_ros.dashboard import teaching_demo  # loads the page's server
    return teaching_demo.main(own)


def means_teach(argument: str) -> bool:
    """Whether argparse takes an argument as `--teach`: a shorter beginning means it too."""
    return len(argument) > 2 and TEACH.startswith(argument)
