# SPDX-License-Identifier: Apache-2.0
"""Two hosts on one machine: network namespaces with a cable between them."""

from collections.abc import Generator
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

from waiting import wait_until

INTERFACE = 'cable'  # at either end of the cable
CAPABILITIES = {'CAP_NET_ADMIN': 12, 'CAP_SYS_ADMIN': 21}  # bits, as capabilities(7) counts them


@dataclass(frozen=True)
class Host:
    """
    A network namespace, with one end of the cable.

    Attributes
    ----------
    namespace: name for `ip netns`.
    address: of its end of the cable.
    python: a program that runs Python on this host in place of `sys.executable`.

    """

    namespace: str
    address: str
    python: str

    @contextmanager
    def starting_processes(self) -> Generator[None]:
        """Let every Python process that is started within the block run on this host."""
        with patch.object(sys, 'executable', self.python):
            yield

    def pull_cable(self) -> None:
        """Set the interface down here; on the other host it loses its carrier."""
        self.ip('link', 'set', INTERFACE, 'down')

    def plug_cable(self) -> None:
        """Set the interface up again."""
        self.ip('link', 'set', INTERFACE, 'up')

    def has_carrier(self) -> bool:
        """Tell whether the interface is up: DDS never uses one that is down at the start."""
        return 'state UP' in self.ip('link', 'show', INTERFACE)

    def ip(self, *words: str) -> str:
        """Return the output of `ip` on this host."""
        return _ip('-n', self.namespace, *words)


def missing(capabilities: int | None = None) -> str:
    """
    Return what two hosts need and this machine does not have; '' if nothing is missing.

    capabilities: as bits; by default those of this process.
    """
    if shutil.which('ip') is None:
        return 'two hosts need the tool `ip`, and there is none: apt install iproute2'
    bits = _capabilities() if capabilities is None else capabilities
    lacking = ' and '.join(name for name, bit in CAPABILITIES.items() if not bits >> bit & 1)
    return lacking and (f'two hosts need {lacking}: be root, outside a container or in a '
                        'privileged one')


@contextmanager
def two_hosts(folder: Path) -> Generator[list[Host]]:
    """Give two connected hosts, 10.77.0.1 and 10.77.0.2; they are removed at the end."""
    run = secrets.token_hex(3)
    hosts = [_host(f'comply_{run}_{n}', f'10.77.0.{n}', folder) for n in (1, 2)]
    with ExitStack() as undo:
        for host in hosts:
            _ip('netns', 'add', host.namespace)
            undo.callback(_ip, 'netns', 'delete', host.namespace)
        hosts[0].ip('link', 'add', INTERFACE, 'type', 'veth', 'peer', 'name', INTERFACE,
                    'netns', hosts[1].namespace)
        for host in hosts:
            host.ip('address', 'add', f'{host.address}/24', 'dev', INTERFACE)
            host.ip('link', 'set', 'lo', 'up')
            host.ip('link', 'set', INTERFACE, 'up')
        wait_until(lambda: all(host.has_carrier() for host in hosts), 'carrier')
        yield hosts


def _host(namespace: str, address: str, folder: Path) -> Host:
    """Return a `Host`; its `python` is written into the folder."""
    python = Path(folder) / f'python_{namespace}'
    python.write_text(f'#!/bin/sh\nexec ip netns exec {namespace} '
                      f'{shlex.quote(sys.executable)} "$@"\n')
    python.chmod(0o755)
    return Host(namespace, address, str(python))


def _ip(*words: str) -> str:
    """Return the output of `ip`; raises OSError with its error."""
    done = subprocess.run(['ip', *words], capture_output=True, text=True, check=False)
    if done.returncode:
        raise OSError(f'`ip {" ".join(words)}` must succeed, and failed: {done.stderr.strip()}')
    return done.stdout


def _capabilities() -> int:
    """Effective capabilities of this process, as bits."""
    return int(re.search(r'CapEff:\s*(\w+)', Path('/proc/self/status').read_text())[1], 16)
