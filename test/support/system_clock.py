# SPDX-License-Identifier: Apache-2.0
"""A system clock that a test sets, for the processes that it starts: Debian's `faketime`."""

from pathlib import Path

import pytest

LIBRARIES = sorted(Path('/usr/lib').glob('**/faketime/libfaketimeMT.so.1'))
needs_faketime = pytest.mark.skipif(
    not LIBRARIES, reason='the Debian package faketime sets the clock of a process')


class SystemClock:
    """The system clock of processes that are started from now on; steady clocks stay."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, file: Path) -> None:
        self._file = file
        self.set_back(0)
        for name, value in (('LD_PRELOAD', LIBRARIES[0]), ('FAKETIME_TIMESTAMP_FILE', file),
                            ('FAKETIME_DONT_FAKE_MONOTONIC', 1), ('FAKETIME_NO_CACHE', 1)):
            monkeypatch.setenv(name, str(value))

    def set_back(self, hours: int) -> None:
        """Set the clock of all of them to so many hours before now."""
        written = self._file.with_suffix('.new')
        written.write_text(f'-{hours}h\n')
        written.rename(self._file)
