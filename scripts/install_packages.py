# SPDX-License-Identifier: Apache-2.0
"""
Install packages into the environment of this Python, with the arguments of `pip install`.

Where all packages are pinned (`--no-deps`), uv installs them, which takes a quarter of the time of
pip. pip installs them where uv cannot be had or fails, and says why if it fails too.

Of the user's settings of pip, in files and variables, those are kept that say how packages are
reached (an index, a proxy, certificates). Others, such as `user` or `target`, would install
something else, or elsewhere.
"""

from ast import literal_eval
import os
import subprocess
import sys

# The settings of pip that are kept, and the variable that says the same to uv.
KEPT = {
    'cache-dir': None, 'cert': 'SSL_CERT_FILE', 'client-cert': 'SSL_CLIENT_CERT',
    'default-timeout': 'UV_HTTP_TIMEOUT', 'extra-index-url': 'UV_INDEX',
    'find-links': 'UV_FIND_LINKS', 'index-url': 'UV_DEFAULT_INDEX', 'keyring-provider': None,
    'no-cache-dir': 'UV_NO_CACHE', 'no-index': 'UV_NO_INDEX', 'proxy': 'ALL_PROXY',
    'retries': 'UV_HTTP_RETRIES', 'timeout': 'UV_HTTP_TIMEOUT',
    'trusted-host': 'UV_INSECURE_HOST', 'use-feature': None,
}
SECTIONS = ('global', 'install', ':env:')  # the later one wins
PIP = (sys.executable, '-m', 'pip', '--disable-pip-version-check')
UV = 'uv==0.13.9'  # installs the packages of a list at the same time


def kept_settings() -> dict[str, str]:
    """Return the user's settings of pip that are kept, by their names."""
    listed = subprocess.run((*PIP, 'config', 'list'), stdout=subprocess.PIPE, text=True,
                            check=False).stdout
    found = {}
    for line in listed.splitlines():  # global.index-url='https://...'
        section_and_name, _, value = line.partition('=')
        section, _, name = section_and_name.rpartition('.')
        if name in KEPT and section in SECTIONS:
            found[section, name] = literal_eval(value)
    return {name: value for (_, name), value in sorted(
        found.items(), key=lambda item: SECTIONS.index(item[0][0]))}


def for_pip(settings: dict[str, str]) -> dict[str, str]:
    """Return the environment variables that give pip these settings and no others."""
    return {'PIP_CONFIG_FILE': os.devnull, **{
        f'PIP_{name.upper().replace("-", "_")}': value for name, value in settings.items()}}


def for_uv(settings: dict[str, str]) -> dict[str, str]:
    """Return the environment variables that give uv these settings of pip and no others."""
    return {
        'UV_NO_CONFIG': '1', 'UV_INDEX_STRATEGY': 'unsafe-best-match',  # as pip: of all indexes
        **{variable: value for name, value in settings.items() if (variable := KEPT[name])}}


def main(arguments: list[str]) -> int:
    settings = kept_settings()
    inherited = {name: value for name, value in os.environ.items()
                 if not name.startswith(('PIP_', 'UV_'))}
    pip = (*PIP, 'install', '-qq'), {**inherited, **for_pip(settings)}
    uv = ((sys.executable, '-m', 'uv', 'pip', 'install', '--quiet', '--compile-bytecode',
           '--python', sys.executable), {**inherited, **for_uv(settings)})

    def install(tool, *options: str, **streams) -> int:
        command, variables = tool
        return subprocess.run((*command, *options), env=variables, check=False,
                              **streams).returncode

    unseen = {'stdout': subprocess.DEVNULL, 'stderr': subprocess.DEVNULL}
    if '--no-deps' in arguments and not install(pip, '--retries=1', UV, **unseen) and \
            not install(uv, *arguments, **unseen):
        return 0
    return install(pip, *arguments)


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
