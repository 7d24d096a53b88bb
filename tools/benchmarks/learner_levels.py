# SPDX-License-Identifier: Apache-2.0
"""What a step of a learner without a model costs at each level, without ROS: median of a call."""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import replace
from statistics import median
from time import perf_counter_ns, time_ns
from typing import Any

from comply_ros.learner.presets import METHODS
from comply_ros.nodes.topics import ACTION, reader, RECOMMENDATION, STATE, writer
from comply_ros.protocol.learner import Learner
from comply_ros.protocol.mentor import Mentor
from comply_ros.protocol.messages import Action, Recommendation, StateReward, WorldDescription
from comply_ros.protocol.world import WorldMachine
from comply_ros.storage.map_files import read_map
from comply_ros.storage.mentor_cache import mentor_policy, read_mentor_spec
from comply_ros.world.mdp import World
from tools.benchmarks.in_process import MAP, MENTOR, PROFILE
from tools.benchmarks.interleave import Bench, Row

METHOD, RUN, STEPS, WARM_UP = 'beta_implicit', 7, 4000, 500
AGENT, LEARNER, DECODE, ENCODE = (
    'Agent.step', 'Learner.observe', 'decode a state', 'encode an action')
KERNELS = {'the kernel choose_action': 'choose_action', 'the kernel learn': 'learn'}
ADVICE, DECODE_ADVICE = 'Learner.on_recommendation', 'decode a recommendation'


def measure_levels(bench: Bench) -> tuple[list[Row], dict[str, list[float]]]:
    """Rows of the section `levels`, and the microseconds that they come from."""
    world, messages = recorded_messages(300 if bench.quick else STEPS)
    actions = replayed(world, messages, LEARNER)[1]
    figures = bench.interleave('levels', {
        **{level: lambda level=level: replayed(world, messages, level)[0]
           for level in (*KERNELS, AGENT, LEARNER, ADVICE)},
        DECODE: lambda: conversion_time(reader(STATE), encoded(messages, STATE)),
        DECODE_ADVICE: lambda: conversion_time(
            reader(RECOMMENDATION), encoded(messages, RECOMMENDATION)),
        ENCODE: lambda: conversion_time(writer(ACTION, time_ns), actions)})
    return [Row(f'{name}, microseconds', each) for name, each in figures.items()], figures


def new_learner() -> Learner:
    """Return the learner of the benchmark `loop`."""
    return Learner(replace(METHODS[PROFILE][METHOD], measuring_iterations=0, iterations=0), 0)


def recorded_messages(steps: int) -> tuple[WorldDescription, list[Any]]:
    """Return a world, and what a learner receives there in so many steps."""
    world, mentor, learner = WorldMachine(read_map(MAP, PROFILE), MAP, RUN, 0), Mentor(), \
        new_learner()
    mentor.on_world(world.description)
    learner.on_world(world.description)
    mentor.use(mentor_policy(read_mentor_spec(MENTOR), World(read_map(MAP, PROFILE)), 0))
    receivers: dict[type, Sequence[Callable[[Any], Any]]] = {
        StateReward: (learner.observe, mentor.observe), Recommendation: learner.receivers,
        Action: (world.on_action,)}
    received, on_the_way = list[Any](), deque([world.observation])
    while learner.step_count < steps:
        msg = on_the_way.popleft()
        if isinstance(msg, (StateReward, Recommendation)):
            received.append(msg)
        for receive in receivers.get(type(msg), ()):
            on_the_way += receive(msg)
    return world.description, received


def replayed(world: WorldDescription, messages: Sequence[Any],
             level: str) -> tuple[float, list[Action]]:
    """Let a new learner receive the messages; return the median of a level, and its actions."""
    learner, times = new_learner(), list[int]()
    learner.on_world(world)
    learner.keeps_journal = False
    agent, observe, receive = learner.agent, learner.observe, learner.receivers[0]
    if level in KERNELS:
        name = KERNELS[level]
        kernel = timed(getattr(agent._kernels, name), times)
        setattr(agent, '_kernels', agent._kernels._replace(**{name: kernel}))
    elif level == AGENT:
        setattr(agent, 'step', timed(agent.step, times))
    elif level == LEARNER:
        observe = timed(observe, times)
    else:
        receive = timed(receive, times)
    outputs = [output for msg in messages
               for output in (observe if isinstance(msg, StateReward) else receive)(msg)]
    return median(times[WARM_UP:] or times) / 1e3, [
        each for each in outputs if isinstance(each, Action)]


def timed(function: Callable[..., Any], times: list[int]) -> Callable[..., Any]:
    """Return the function, which appends the time of each call, in nanoseconds."""
    def call(*arguments: Any) -> Any:
        start = perf_counter_ns()
        result = function(*arguments)
        times.append(perf_counter_ns() - start)
        return result
    return call


def encoded(messages: Sequence[Any], topic: Any) -> list[bytes]:
    """Return the messages of a topic as bytes."""
    write = writer(topic, time_ns)
    return [write(msg) for msg in messages if isinstance(msg, topic.tuple_type)]


def conversion_time(convert: Callable[[Any], Any], values: Sequence[Any]) -> float:
    """Return the median time of a conversion, in microseconds."""
    times: list[int] = []
    convert = timed(convert, times)
    for value in values:
        convert(value)
    return median(times) / 1e3
