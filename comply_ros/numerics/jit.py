# SPDX-License-Identifier: Apache-2.0
"""The one file that knows numba: every kernel is plain Python until it is asked for compiled."""

from collections.abc import Callable
from functools import cache
from importlib.util import find_spec
from pickle import UnpicklingError
from types import FunctionType
from typing import Any, Protocol, TypeVar

Function = TypeVar('Function', bound=FunctionType)
KERNELS: dict[str, Callable[..., Any]] = {}
# Of them, those that compiled code calls: the field without which it does not, and a stand-in.
CALLED: dict[Callable[..., Any], tuple[str, Any]] = {}
# No code that counts references, and none for callers in C: there are none of either.
WITHOUT: Any = {'_nrt': False, 'no_cfunc_wrapper': True}
COMPILER_LIBRARY = 'libllvmlite'  # what compiles and loads machine code, which does not call it
SPOILED = EOFError, ImportError, OSError, ValueError, UnpicklingError  # what a bad cache raises


class CodeCache(Protocol):
    """Where compiled code is kept from one process to the next."""

    def folder(self) -> str | None:
        """Folder for the code of the present sources; None where there can be none."""

    def clear(self) -> None:
        """Delete that folder."""


_caches: list[CodeCache] = []  # the one in use, if any
_registered: set[Callable[..., Any]] = set()  # kernels that compiled code can call


def use_cache(code_cache: CodeCache) -> None:
    """Keep all that is compiled from now on in a cache; without one, each process compiles."""
    _caches[:] = [code_cache]


def kernel(function: Function) -> Function:
    """Return the function unchanged, and remember that compiled code may call it."""
    KERNELS[f'{function.__module__}.{function.__qualname__}'] = function
    return function


def long_kernel(field: str, otherwise: Any) -> Callable[[Function], Function]:
    """
    Return a decorator of a kernel that compiled code calls, and does not take in.

    For a long one with several callers, of which each would compile it again. Where the tuple of
    settings that is among its arguments has an empty tuple in a field, it is not compiled at all:
    then it is never called, and what it would return is `otherwise`, which only has its type.
    """
    def decorate(function: Function) -> Function:
        CALLED[function] = field, otherwise
        return kernel(function)
    return decorate


def plain_view(array: Any) -> Any:
    """View of an array for plain kernels: single elements come three times as fast."""
    return memoryview(array)


def plain_fields(values: Any) -> Any:
    """Return an object with the fields of a NamedTuple for plain kernels: four times as fast."""
    found = _slots_of(type(values))()
    for name, value in zip(values._fields, values):
        setattr(found, name, value)
    return found


@cache
def _slots_of(kind: Any) -> Any:
    return type(f'Plain{kind.__name__}', (), {'__slots__': kind._fields})


@cache
def compiled(entry: Callable[..., Any]) -> Callable[..., Any]:
    """
    Return entry as machine code with all kernels it calls; without numba, entry itself.

    Kernels allocate nothing (numba says so where one does): without counting references, and with
    all calls inlined, they are two to four times as fast, with the same bits.
    """
    try:
        import numba
    except ImportError:
        return entry
    _register_kernels()
    folder = _caches[0].folder() if _caches else None
    if folder:
        setattr(numba.config, 'CACHE_DIR', folder)
    return numba.njit(nogil=True, error_model='numpy', cache=bool(folder), **WITHOUT)(entry)


def _register_kernels() -> None:
    """Let compiled code call all kernels; each is registered once, so entries share its code."""
    from numba.extending import register_jitable
    for function in KERNELS.values():
        if function in _registered:
            continue
        _registered.add(function)
        if function in CALLED:
            _register_call(function, *CALLED[function])
        else:
            register_jitable(forceinline=True, **WITHOUT)(function)


def _register_call(function: Callable[..., Any], field: str, otherwise: Any) -> None:
    """Let compiled code call a kernel, or a stand-in where the field of a tuple is empty."""
    from numba.extending import overload

    @overload(function, jit_options=WITHOUT, strict=False)
    def choose(*kinds: Any) -> Callable[..., Any]:
        for kind in kinds:
            fields = getattr(kind, 'fields', ())
            if field in fields and len(kind.types[fields.index(field)]) == 0:
                return lambda *arguments: otherwise
        return function


def run_compiled(entry: Callable[..., Any], *arguments: Any) -> Any:
    """Return what entry returns, run as machine code; compile again where the cache is spoiled."""
    try:
        return compiled(entry)(*arguments)
    except SPOILED:  # raised before anything ran
        forget()
        return compiled(entry)(*arguments)


def specialized(entry: Callable[..., Any], *arguments: Any) -> Callable[..., Any]:
    """
    Return entry compiled for the types of these arguments, to be called with no others.

    A call costs a tenth of one of `compiled`, which looks at the type of every array each time.
    """
    try:
        return _overload(compiled(entry), arguments)
    except SPOILED:
        forget()
        return _overload(compiled(entry), arguments)


def cached(entry: Callable[..., Any], *arguments: Any) -> Callable[..., Any] | None:
    """
    Return what `specialized` returns if that is in the cache; None where it must be compiled.

    Another thread may call it.
    """
    function: Any = compiled(entry)
    if not hasattr(function, 'overloads'):
        return None
    from numba import typeof
    from numba.core.compiler_lock import global_compiler_lock
    try:
        with global_compiler_lock:
            found = function._cache.load_overload(tuple(map(typeof, arguments)),
                                                  function.targetctx)
    except SPOILED:
        forget()
        return None
    return found.entry_point if found else None


def can_cache() -> bool:
    """Tell whether what is compiled is kept: there is a compiler, and a place."""
    return find_spec('numba') is not None and bool(_caches and _caches[0].folder())


def _overload(function: Any, arguments: tuple[Any, ...]) -> Callable[..., Any]:
    if not hasattr(function, 'overloads'):  # there is no compiler
        return function
    from numba import typeof
    types = tuple(map(typeof, arguments))
    function.compile(types)
    return function.overloads[types].entry_point


def forget() -> None:
    """Delete the compiled code, in the cache and in this process."""
    for code_cache in _caches:
        code_cache.clear()
    compiled.cache_clear()
