# SPDX-License-Identifier: Apache-2.0
"""Two machines in one: network namespaces, joined by a cable that can be pulled."""

from contextlib import contextmanager, ExitStack
from dataclasses import dataclass
from pathlib import Path
import secrets
import shlex
import shutil
import subprocess
import sys
from unittest.mock import patch

from nodes import wait_until

END = 'cable'  # name of the interface at either end: the two are in namespaces of their own
RIGHTS = {'CAP_NET_ADMIN': 12, 'CAP_SYS_ADMIN': 21}  # bits of capabilities(7)


@dataclass(frozen=True)
class Host:
    """
    A machine of its own as far as the network goes.

    namespace: its name for `ip netns`.
    address: of its end of the cable.
    python: file to run in the place of `sys.executable`; the process keeps its id.
    """

    namespace: str
    address: str
    python: str

    @contextmanager
    def here(self):
        """Start on this host whatever Python is started while the block runs."""
        with patch.object(sys, 'executable', self.python):
            yield

    def pull_cable(self):
        """Take the cable out: the interface goes down here, and has no carrier over there."""
        _ip('-n', self.namespace, 'link', 'set', END, 'down')

    def plug_cable(self):
        """Put the cable in again."""
        _ip('-n', self.namespace, 'link', 'set', END, 'up')

    def has_carrier(self):
        """Tell whether the interface runs: DDS never uses one that did not when it started."""
        return 'state UP' in _ip('-n', self.namespace, 'link', 'show', END)


def missing():
    """Text of the tool or the rights that two hosts need and that are not here, '' if none."""
    if shutil.which('ip') is None:
        return 'two hosts need the tool `ip`, and there is none: sudo apt install iproute2'
    held = int(Path('/proc/self/status').read_text().partition('CapEff:')[2].split()[0], 16)
    lacking = [name for name, bit in RIGHTS.items() if not held >> bit & 1]
    return lacking and f'two hosts need {" and ".join(lacking)}: be root, outside a container'


@contextmanager
def two_hosts(folder):
    """Give two `Host`s with a cable between them; nothing of them is left at the end."""
    run = secrets.token_hex(3)
    with ExitStack() as undo:
        hosts = [_host(f'comply_{run}_{n}', f'10.77.0.{n}', folder) for n in (1, 2)]
        for host in hosts:
            _ip('netns', 'add', host.namespace)
            undo.callback(_ip, 'netns', 'delete', host.namespace)
        one, other = (host.namespace for host in hosts)
        _ip('-n', one, 'link', 'add', END, 'type', 'veth', 'peer', 'name', END, 'netns', other)
        for host in hosts:
            _ip('-n', host.namespace, 'address', 'add', f'{host.address}/24', 'dev', END)
            for interface in ('lo', END):
                _ip('-n', host.namespace, 'link', 'set', interface, 'up')
        wait_until(lambda: all(host.has_carrier() for host in hosts), 'carrier')
        yield hosts


def _host(namespace, address, folder):
    """Return a `Host` whose Python is written into the folder."""
    python = Path(folder) / f'python_{namespace}'
    python.write_text(f'#!/bin/sh\nexec ip netns exec {namespace} '
                      f'{shlex.quote(sys.executable)} "$@"\n')
    python.chmod(0o755)
    return Host(namespace, address, str(python))


def _ip(*words):
    """Return what `ip` prints; an error has what it said."""
    done = subprocess.run(['ip', *words], capture_output=True, text=True, check=False)
    if done.returncode:
        raise OSError(f'`ip {" ".join(words)}` must succeed, said: {done.stderr.strip()}')
    return done.stdout
