# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""Pairs wheel speeds, train speeds and traction forces by their stamps, whatever order they arrive in.

A wheel speed waits until the other two of its own time are known, that is, until both have come with the same or a
later stamp, or until the wheel speeds have moved on by `max_wait_s`. Only stamps decide, never the clock: a live node
and an offline replay pair alike.
"""

from __future__ import annotations

from bisect import bisect_right, insort
from typing import NamedTuple, TypeVar

from ..intake.inbox import HORIZON_NS, SpeedSample, WheelSample


class ForceSample(NamedTuple):
    """Measured traction force of all driven axles together, at the rim."""

    t_ns: int
    force_n: float


class Paired(NamedTuple):
    """What was measured at one time; a value that is None was not."""

    t_ns: int
    speeds_radps: tuple[float, ...]
    speed_mps: float | None
    force_n: float | None


Sample = WheelSample | SpeedSample | ForceSample
Stamped = TypeVar("Stamped", SpeedSample, ForceSample)


class CreepAligner:
    """Merges the three streams. Mutable: it is the inbox of one node or one replay."""

    def __init__(self, max_wait_s: float, max_age_s: float) -> None:
        self._max_wait_ns = round(max_wait_s * 1e9)
        self._max_age_ns = round(max_age_s * 1e9)
        self._newest_ns: int | None = None
        self._wheels: list[WheelSample] = []
        self._speeds: list[SpeedSample] = []
        self._forces: list[ForceSample] = []

    def push(self, sample: Sample) -> list[Paired]:
        """Take one sample; return what is complete now, in the order of the wheel speeds' arrival."""
        before: list[Paired] = []
        if isinstance(sample, SpeedSample):
            insort(self._speeds, sample)
        elif isinstance(sample, ForceSample):
            insort(self._forces, sample)
        else:
            if self._newest_ns is not None and abs(sample.t_ns - self._newest_ns) > HORIZON_NS:
                before, self._newest_ns = self.flush(), None
            self._newest_ns = sample.t_ns if self._newest_ns is None else max(self._newest_ns, sample.t_ns)
            self._wheels.append(sample)
        return before + self._release()

    def flush(self) -> list[Paired]:
        """Return what still waits, with what is known so far (end of the data)."""
        return self._take(len(self._wheels))

    def _release(self) -> list[Paired]:
        if self._newest_ns is None:
            return []
        self._forget(self._newest_ns)
        both = min(self._speeds[-1].t_ns if self._speeds else 0, self._forces[-1].t_ns if self._forces else 0)
        known_until = max(both, self._newest_ns - self._max_wait_ns)
        ready = 0
        while ready < len(self._wheels) and self._wheels[ready].t_ns <= known_until:
            ready += 1
        return self._take(ready)

    def _take(self, count: int) -> list[Paired]:
        taken, self._wheels = self._wheels[:count], self._wheels[count:]
        return [self._pair(wheel) for wheel in taken]

    def _pair(self, wheel: WheelSample) -> Paired:
        speed, force = self._latest(self._speeds, wheel.t_ns), self._latest(self._forces, wheel.t_ns)
        return Paired(*wheel, speed and speed.speed_mps, force and force.force_n)

    def _latest(self, samples: list[Stamped], t_ns: int) -> Stamped | None:
        """Return the newest sample at or before a time, unless it is too old."""
        newest = bisect_right(samples, t_ns, key=lambda sample: sample.t_ns) - 1
        if newest < 0 or t_ns - samples[newest].t_ns > self._max_age_ns:
            return None
        return samples[newest]

    def _forget(self, newest_ns: int) -> None:
        for samples in (self._speeds, self._forces):
            while samples and abs(samples[0].t_ns - newest_ns) > HORIZON_NS:
                samples.pop(0)
            while samples and abs(samples[-1].t_ns - newest_ns) > HORIZON_NS:
                samples.pop()
