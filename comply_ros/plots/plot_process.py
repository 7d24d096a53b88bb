# SPDX-License-Identifier: Apache-2.0
"""A process that draws: it loads matplotlib on another core while this one learns."""

from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import contextmanager
from importlib import import_module
from multiprocessing import get_context
import os
import signal

from comply_ros.terminal.interrupts import end_with_parent


@contextmanager
def plot_process():
    """
    Give a function that draws: called with a name of `pictures` and its arguments, a future.

    To be entered before there are threads: the process is a fork of this one.
    """
    with ProcessPoolExecutor(1, get_context('fork'), _init_worker, (os.getpid(),)) as pool:
        pool.submit(_pictures)
        yield lambda name, *arguments: pool.submit(_draw, name, *arguments)


def plot_in_process(name, *arguments):
    """Draw in this process, which may have threads; return the future, done."""
    done = Future()
    done.set_result(_draw(name, *arguments))
    return done


def _init_worker(parent):
    """Leave Ctrl-C to the parent, and end when it does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    end_with_parent(parent)


def _pictures():
    import_module('comply_ros.plots.training_plots')


def _draw(name, *arguments):
    getattr(import_module('comply_ros.plots.training_plots'), name)(*arguments)
