# SPDX-License-Identifier: Apache-2.0
"""`python -m tools NAME ...`: runs a tool, as `scripts/NAME` does."""

from importlib import import_module
import sys

from comply_ros.executables import start


def run(name: str, argv: list[str]) -> int:
    """Return the exit code of a tool; the one line of its errors begins with its name."""
    module = 'tools.benchmarks.__main__' if name == 'benchmarks' else f'tools.{name}'

    def program() -> int:
        tool = import_module(module)
        from comply_ros.nodes.ros_start import RosStartError
        from comply_ros.terminal.standard_output import standard_output
        try:
            with standard_output():
                return tool.main([name, *argv])
        except RosStartError as error:
            print(f'{name}: {error}', file=sys.stderr)
            return 2
    return start(name, True, program)


if __name__ == '__main__':
    sys.exit(run(sys.argv[1], sys.argv[2:]))
