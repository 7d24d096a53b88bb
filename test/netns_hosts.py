# SPDX-License-Identifier: Apache-2.0
"""Two machines in one: network namespaces, joined by a cable that can be pulled."""

from contextlib import contextmanager, ExitStack
from dataclasses import dataclass
from pathlib import Path
import re
import secrets
import shlex
import shutil
import subprocess
import sys
from unittest.mock import patch

from node_processes import wait_until

PLUG = 'cable'  # name of the interface at either end; each is in a namespace of its own
RIGHTS = {'CAP_NET_ADMIN': 12, 'CAP_SYS_ADMIN': 21}  # bits, as capabilities(7) counts them


@dataclass(frozen=True)
class Host:
    """
    A machine of its own as far as the network goes.

    Attributes
    ----------
    namespace: its name for `ip netns`.
    address: of its end of the cable.
    python: a file to start in the place of `sys.executable`; the process id stays the same.

    """

    namespace: str
    address: str
    python: str

    @contextmanager
    def starts_what_follows(self):
        """Let every Python that is started while the block runs start on this host."""
        with patch.object(sys, 'executable', self.python):
            yield

    def pull_cable(self):
        """Take the cable out: the interface goes down here, and loses its carrier over there."""
        self.ip('link', 'set', PLUG, 'down')

    def plug_cable(self):
        """Put the cable in again."""
        self.ip('link', 'set', PLUG, 'up')

    def has_carrier(self):
        """Tell whether the interface runs: DDS never uses one that does not when it starts."""
        return 'state UP' in self.ip('link', 'show', PLUG)

    def ip(self, *words):
        """Return what `ip` prints on this host."""
        return _ip('-n', self.namespace, *words)


def missing(rights=None):
    """
    Text of what two hosts need and what is not here, '' if nothing is.

    rights: capabilities as bits; those of this process where they are not given.
    """
    if shutil.which('ip') is None:
        return 'two hosts need the tool `ip`, and there is none: apt install iproute2'
    held = _rights() if rights is None else rights
    lacking = ' and '.join(name for name, bit in RIGHTS.items() if not held >> bit & 1)
    return lacking and (f'two hosts need {lacking}: be root, outside a container or in a '
                        'privileged one')


@contextmanager
def two_hosts(folder):
    """Give two `Host`s joined by a cable, 10.77.0.1 and .2; nothing of them is left at the end."""
    run = secrets.token_hex(3)
    hosts = [_host(f'comply_{run}_{n}', f'10.77.0.{n}', folder) for n in (1, 2)]
    with ExitStack() as undo:
        for host in hosts:
            _ip('netns', 'add', host.namespace)
            undo.callback(_ip, 'netns', 'delete', host.namespace)
        hosts[0].ip('link', 'add', PLUG, 'type', 'veth', 'peer', 'name', PLUG,
                    'netns', hosts[1].namespace)
        for host in hosts:
            host.ip('address', 'add', f'{host.address}/24', 'dev', PLUG)
            host.ip('link', 'set', 'lo', 'up')
            host.ip('link', 'set', PLUG, 'up')
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


def _rights():
    """Effective capabilities of this process, as bits."""
    return int(re.search(r'CapEff:\s*(\w+)', Path('/proc/self/status').read_text())[1], 16)
