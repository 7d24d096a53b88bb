# SPDX-License-Identifier: Apache-2.0
"""
Install packages into the environment of this Python, with the arguments of `pip install`.

Of the user's settings of pip, in files and variables, those are kept that say how packages are
reached (an index, a proxy, certificates). Others, such as `user` or `target`, would install
something else, or elsewhere.
"""

from ast import literal_eval
import os
import subprocess
import sys

KEPT = {'cache-dir', 'cert', 'client-cert', 'default-timeout', 'extra-index-url', 'find-links',
        'index-url', 'keyring-provider', 'no-cache-dir', 'no-index', 'proxy', 'retries',
        'timeout', 'trusted-host', 'use-feature'}
SECTIONS = ('global', 'install', ':env:')  # the later one wins
PIP = (sys.executable, '-m', 'pip', '--disable-pip-version-check')


def kept_settings() -> dict[str, str]:
    """Environment variables for pip with the user's settings that are kept."""
    listed = subprocess.run((*PIP, 'config', 'list'), stdout=subprocess.PIPE, text=True,
                            check=False).stdout
    found = {}
    for line in listed.splitlines():  # global.index-url='https://...'
        section_and_name, _, value = line.partition('=')
        section, _, name = section_and_name.rpartition('.')
        if name in KEPT and section in SECTIONS:
            found[section, name] = literal_eval(value)
    return {f'PIP_{name.upper().replace("-", "_")}': value for (_, name), value in sorted(
        found.items(), key=lambda item: SECTIONS.index(item[0][0]))}


def main(arguments: list[str]) -> int:
    settings = kept_settings()
    inherited = {name: value for name, value in os.environ.items() if not name.startswith('PIP_')}
    return subprocess.run((*PIP, 'install', '-qq', *arguments), check=False, env={
        **inherited, **settings, 'PIP_CONFIG_FILE': os.devnull}).returncode


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
