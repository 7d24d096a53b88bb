# SPDX-License-Identifier: Apache-2.0
"""
Learning from a suboptimal teacher: how far to comply, state by state, over ROS 2 topics.

`comply_ros.train` learns in this process; importing the package loads nothing else before that.
"""

from importlib import import_module
from typing import Any, TYPE_CHECKING

if TYPE_CHECKING:
    from comply_ros.experiments.train_api import train, TrainingResult

__version__ = '0.1.0'
__all__ = ('train', 'TrainingResult')


def __getattr__(name: str) -> Any:
    """Load what `__all__` names when it is used for the first time."""
    if name not in __all__:
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    value = globals()[name] = getattr(import_module('comply_ros.experiments.train_api'), name)
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
