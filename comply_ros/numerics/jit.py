# SPDX-License-Identifier: Apache-2.0
"""The one file that knows numba: every kernel is plain Python until it is asked for compiled."""

from functools import cache
import hashlib
import os
from pathlib import Path
from pickle import UnpicklingError
import shutil
from typing import Any

KERNELS = {}
SPOILED = EOFError, ImportError, OSError, ValueError, UnpicklingError  # what a bad cache raises


def kernel(function):
    """Return the function unchanged, and remember that compiled code may call it."""
    KERNELS[f'{function.__module__}.{function.__qualname__}'] = function
    return function


def plain_view(array: Any) -> Any:
    """View of an array for plain kernels: single elements come three times as fast."""
    return memoryview(array)


@cache
def source_hash():
    """SHA-256 (hex) over the sources of core: it changes when any formula changes."""
    sources = sorted(Path(__file__).parents[1].glob('*/*.py'))
    return hashlib.sha256(b''.join(path.read_bytes() for path in sources)).hexdigest()


def cache_folder():
    """Where what is slow to make is kept: `$XDG_CACHE_HOME/comply_ros` (`~/.cache` by default)."""
    return Path(os.environ.get('XDG_CACHE_HOME') or Path.home() / '.cache') / 'comply_ros'


@cache
def compiled(entry):
    """
    Return entry as machine code with all kernels it calls; without numba, entry itself.

    Kernels allocate nothing (numba says so where one does): without counting references, and with
    all calls inlined, they are two to four times as fast, with the same bits.
    """
    try:
        import numba
        from numba.extending import register_jitable
    except ImportError:
        return entry
    for function in KERNELS.values():
        if function is not entry:
            register_jitable(_nrt=False, forceinline=True)(function)
    return numba.njit(nogil=True, error_model='numpy', cache=_keeps_code(numba),
                      _nrt=False)(entry)


def run_compiled(entry, *arguments):
    """Return what entry returns, run as machine code; what is kept and spoiled is made anew."""
    try:
        return compiled(entry)(*arguments)
    except SPOILED:  # raised before anything ran
        forget()
        return compiled(entry)(*arguments)


def specialized(entry, *arguments):
    """
    Return entry compiled for the types of these arguments, to be called with no others.

    A call costs a tenth of one of `compiled`, which looks at the type of every array each time.
    """
    try:
        return _overload(compiled(entry), arguments)
    except SPOILED:
        forget()
        return _overload(compiled(entry), arguments)


def _overload(function, arguments):
    if not hasattr(function, 'overloads'):  # there is no compiler
        return function
    from numba import typeof
    types = tuple(map(typeof, arguments))
    function.compile(types)
    return function.overloads[types].entry_point


def forget():
    """Delete what was compiled before, for a start from the sources."""
    shutil.rmtree(cache_folder() / 'kernels', ignore_errors=True)
    compiled.cache_clear()


def _keeps_code(numba):
    """
    Point numba at a cache of this very source; return False where it cannot be written.

    numba notices a change of the compiled function, not of the functions that it calls:
    a folder of its own for each state of the sources keeps old machine code from being run.
    """
    folder = cache_folder() / 'kernels' / source_hash()[:16]
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    numba.config.CACHE_DIR = str(folder)
    return os.access(folder, os.W_OK)
