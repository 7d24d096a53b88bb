# SPDX-License-Identifier: Apache-2.0
"""How rclpy starts: what is wrong with arguments and environment, in one sentence."""

from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
import os
from warnings import catch_warnings

import rclpy
from rclpy.logging import (
    get_logger_effective_level,
    get_logger_level,
    LoggingSeverity,
    set_logger_level,
)
from rclpy.signals import SignalHandlerOptions

from comply_ros.storage.file_system import printable

MIDDLEWARE_LOGGERS = ('rcutils', 'rmw_dds_common', 'rmw_fastrtps_cpp', 'rmw_fastrtps_shared_cpp',
                      'rmw_cyclonedds_cpp', 'rmw_zenoh_cpp', 'rcl_lifecycle', 'rcl_action')
LARGEST_DOMAIN = 232  # DDS has no ports for more; Fast DDS ends the process
SWITCHES = ('RCUTILS_LOGGING_USE_STDOUT', 'RCUTILS_LOGGING_BUFFERED_STREAM',
            'RCUTILS_COLORIZED_OUTPUT')  # environment variables that are 0 or 1
ERROR_PREFIXES = ('failed to initialize rcl: ', 'failed to initialize logging: ',
                  'error creating node: ')  # of rclpy, before its reason


class RosStartError(RuntimeError):
    """ROS cannot start here; the message names what is wrong and what to do."""


def start_rclpy(argv: Sequence[str]) -> None:
    """
    Start rclpy, without signal handlers of its own: they break into callbacks.

    argv: name of the program, then its ROS arguments.

    Raises RosStartError for what is wrong with the arguments or the environment.
    """
    if os.environ.get('NO_COLOR'):
        os.environ.setdefault('RCUTILS_COLORIZED_OUTPUT', '0')
    for name in SWITCHES:  # rclpy logs a warning of its own, and fails without a reason
        value = os.environ.get(name)
        if value not in (None, '', '0', '1'):
            raise RosStartError(
                f'environment variable {name} must be 0 or 1, got {printable(value)!r}')
    with rclpy_errors('the arguments after --ros-args must be known and valid: '):
        set_logger_level('rcl', LoggingSeverity.FATAL)  # it logs the same in a line before ours
        rclpy.init(args=list(argv), signal_handler_options=SignalHandlerOptions.NO)
    _set_log_levels()
    domain = rclpy.get_default_context().get_domain_id()
    if domain > LARGEST_DOMAIN:
        raise RosStartError(_domain_rule(str(domain)))


def _set_log_levels() -> None:
    """Let rcl log again; where all is logged, not the middleware: thousands of lines a second."""
    is_debug = get_logger_effective_level('') == LoggingSeverity.DEBUG
    if get_logger_level('rcl') == LoggingSeverity.FATAL:  # and not what --log-level rcl:= says
        set_logger_level('rcl', LoggingSeverity.INFO if is_debug else LoggingSeverity.UNSET)
    for name in MIDDLEWARE_LOGGERS:
        if is_debug and get_logger_level(name) == LoggingSeverity.UNSET:
            set_logger_level(name, LoggingSeverity.INFO)


@contextmanager
def rclpy_errors(rule: str) -> Generator[None]:
    """
    Make errors of rclpy in the block a RosStartError.

    rule: what else must hold, where the environment is not to blame.
    """
    try:
        with catch_warnings(action='ignore', category=RuntimeWarning):  # of what cannot be undone
            yield
    except (RuntimeError, UnicodeError) as error:
        if isinstance(error, RosStartError):
            raise
        raise RosStartError(start_problem(str(error), os.environ, rule)) from None


def start_problem(message: str, environment: Mapping[str, str], rule: str) -> str:
    """
    Return one sentence on why rclpy did not start: what is to blame, and what to do.

    message: of its error.
    rule: what must hold where no environment variable is to blame.
    """
    reason = message
    for prefix in ERROR_PREFIXES:
        reason = reason.removeprefix(prefix)
    reason = printable(' '.join(reason.partition(', at /')[0].split()))
    if 'ROS_DOMAIN_ID' in reason:
        return _domain_rule(environment.get('ROS_DOMAIN_ID', ''))
    if reason.startswith(('Failed to create log directory', 'Failed to get logging directory',
                          'Failed opening file')):
        return _log_folder_rule(environment)
    if environment.get('ROS_SECURITY_ENABLE') == 'true' and (
            'SECURITY' in reason or 'error not set' in reason):
        return ('environment variable ROS_SECURITY_ENABLE needs a ROS with security, and a '
                f'keystore in ROS_SECURITY_KEYSTORE, got {_keystore(environment)} ({reason}): '
                'create the keystore, or unset ROS_SECURITY_ENABLE')
    if 'resolve peer' in reason:
        return ('environment variable ROS_STATIC_PEERS must have addresses of hosts, got '
                f'{environment.get("ROS_STATIC_PEERS", "")!r}')
    return rule + reason


def _domain_rule(value: str) -> str:
    return (f'environment variable ROS_DOMAIN_ID must be an integer in [0, {LARGEST_DOMAIN}], '
            f'got {printable(value)!r}')


def _log_folder_rule(environment: Mapping[str, str]) -> str:
    """Sentence about the folder for log files, from the variable that ROS takes it from."""
    for name in ('ROS_LOG_DIR', 'ROS_HOME', 'HOME'):
        if environment.get(name):
            return (f'environment variable {name} must lead to a folder for log files that can '
                    f'be written, got {printable(environment[name])!r}: set ROS_LOG_DIR to '
                    'another folder')
    return ('a folder for log files must be known, and no HOME is set: set ROS_LOG_DIR to a '
            'folder that can be written')


def _keystore(environment: Mapping[str, str]) -> str:
    folder = environment.get('ROS_SECURITY_KEYSTORE')
    return repr(printable(folder)) if folder else 'none'
