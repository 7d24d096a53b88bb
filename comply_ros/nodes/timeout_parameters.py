# SPDX-License-Identifier: Apache-2.0
"""The parameters for how long a learner waits for advice: of all its mentors, and of each."""

from collections.abc import Iterable, Sequence

from comply_ros.nodes.parameter_node import SafeParameterNode
from comply_ros.nodes.parameters import ADVICE_TIMEOUT, mentor_of_timeout, timeout_of
from comply_ros.numerics.similar_name import did_you_mean
from comply_ros.protocol.advice_timeouts import AdviceTimeouts


class TimeoutParameters:
    """
    Declares `advice_timeout`, and `NAME.advice_timeout` for each mentor that has a name.

    Where a value is given for a mentor that has not joined, its parameter is declared at the start
    too: a value that cannot be ends the node then, and the log says when a value has an effect.

    Parameters
    ----------
    mentors: names of those that the learner waits for.

    Raises
    ------
    ParameterError: for a value that cannot be.

    """

    def __init__(self, node: SafeParameterNode, mentors: Sequence[str]) -> None:
        self._node = node
        self._names: dict[str, str] = {}  # of the parameters, by mentor
        node.declare(ADVICE_TIMEOUT)
        self.declare_for(mentors)
        self._check_given(list(self._names))

    def __contains__(self, name: str) -> bool:
        """Tell whether a parameter is one of these."""
        return name == ADVICE_TIMEOUT.name or name in self._names.values()

    def declare_for(self, mentors: Iterable[str]) -> None:
        """Declare the parameters of mentors that have none yet; they stay declared."""
        for mentor in mentors:
            if mentor and mentor not in self._names:
                parameter = timeout_of(mentor)
                self._node.declare(parameter)
                self._names[mentor] = parameter.name  # after it: to declare one is no change

    def declare_named(self, names: Iterable[str]) -> None:
        """Declare those parameters of mentors that have one of these names."""
        self.declare_for(filter(None, map(mentor_of_timeout, names)))

    def timeouts(self) -> AdviceTimeouts:
        """Return how long to wait for each mentor, as the parameters are now."""
        return AdviceTimeouts(self._node.get_parameter(ADVICE_TIMEOUT.name).value, {
            mentor: self._node.get_parameter(name).value for mentor, name in self._names.items()})

    def _check_given(self, mentors: Sequence[str]) -> None:
        """Declare what was given for others than these mentors, and log what has no effect."""
        log = self._node.get_logger()
        for name in self._node.given_parameters():
            later, (prefix, _, _) = mentor_of_timeout(name), name.partition('.')
            if later is None and prefix in mentors:
                log.warning(f'parameter {name!r} is unknown and has no effect; the only one of a '
                            f'mentor is {timeout_of(prefix).name!r}')
            elif later and later not in mentors:
                self.declare_for([later])
                text = f'parameter {name!r} has no effect until a mentor {later} joins'
                question = did_you_mean(later, mentors, before='; ')
                if question:
                    log.warning(text + question)
                else:
                    log.info(text)
