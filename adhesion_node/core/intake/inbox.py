# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""Pairs the position, brake-pressure, speed and wheel-speed streams by their stamps, whatever order they arrive in.

A position waits until the pressure of its own time is known, that is, until a pressure with the same or a later
stamp has come, or until the positions have moved on by `max_wait_s` (no pressure sensor, or a lost message). Only
stamps decide, never the clock: a live node and an offline replay pair alike.
"""

from __future__ import annotations

from bisect import bisect_right, insort
from statistics import median
from typing import NamedTuple, TypeVar

from .samples import Measurement


class PositionSample(NamedTuple):
    """A measured along-track position."""

    t_ns: int
    position_m: float
    variance_m2: float


class PressureSample(NamedTuple):
    """A measured brake-cylinder pressure, gauge."""

    t_ns: int
    pressure_pa: float


class SpeedSample(NamedTuple):
    """A measured speed."""

    t_ns: int
    speed_mps: float


class WheelSample(NamedTuple):
    """Measured angular speeds of the axles."""

    t_ns: int
    speeds_radps: tuple[float, ...]


Sample = PositionSample | PressureSample | SpeedSample | WheelSample

Timed = TypeVar("Timed", PressureSample, SpeedSample, WheelSample)

HORIZON_NS = 60_000_000_000
"""Samples further apart than this belong to different times: the older ones are spent, or the clock has jumped."""

MOST = 6_000
"""Samples of a stream that are kept at most, 60 s of 100 Hz: no flood and no standing stamps fill the memory."""


class Aligner:
    """Merges the streams into measurements. Mutable: it is the inbox of one node or one replay."""

    def __init__(self, max_wait_s: float, max_pressure_age_s: float) -> None:
        self._max_wait_ns = round(max_wait_s * 1e9)
        self._max_pressure_age_ns = round(max_pressure_age_s * 1e9)
        self._newest_ns: int | None = None
        self._positions: list[PositionSample] = []
        self._pressures: list[PressureSample] = []
        self._speeds: list[SpeedSample] = []
        self._wheels: list[WheelSample] = []

    def push(self, sample: Sample) -> list[Measurement]:
        """Take one sample; return the measurements that are complete now, in the order of their arrival."""
        before: list[Measurement] = []
        if isinstance(sample, PressureSample):
            _insert(self._pressures, sample)
        elif isinstance(sample, SpeedSample):
            _insert(self._speeds, sample)
        elif isinstance(sample, WheelSample):
            _insert(self._wheels, sample)
        else:
            if self._newest_ns is not None and abs(sample.t_ns - self._newest_ns) > HORIZON_NS:
                before = self.flush()
                self._start_anew(sample.t_ns)
            self._newest_ns = sample.t_ns if self._newest_ns is None else max(self._newest_ns, sample.t_ns)
            self._positions.append(sample)
        return before + self._release()

    def flush(self) -> list[Measurement]:
        """Return what still waits, with the pressures known so far (end of the data)."""
        return self._take(len(self._positions))

    def _release(self) -> list[Measurement]:
        if self._newest_ns is None:
            return []
        known_until = self._newest_ns - self._max_wait_ns
        if self._pressures:
            known_until = max(known_until, self._pressures[-1].t_ns)
        ready = max(len(self._positions) - MOST, 0)
        while ready < len(self._positions) and self._positions[ready].t_ns <= known_until:
            ready += 1
        return self._take(ready)

    def _take(self, count: int) -> list[Measurement]:
        taken, self._positions = self._positions[:count], self._positions[count:]
        return [
            Measurement(
                *position, self._pressure(position.t_ns), self._speed(position.t_ns), self._wheel(position.t_ns)
            )
            for position in taken
        ]

    def _pressure(self, t_ns: int) -> float | None:
        newest = bisect_right(self._pressures, t_ns, key=lambda sample: sample.t_ns) - 1
        if newest < 0 or t_ns - self._pressures[newest].t_ns > self._max_pressure_age_ns:
            return None
        return self._pressures[newest].pressure_pa

    def _speed(self, t_ns: int) -> float | None:
        newest = bisect_right(self._speeds, t_ns, key=lambda sample: sample.t_ns) - 1
        if newest < 0 or t_ns - self._speeds[newest].t_ns > self._max_wait_ns:
            return None
        return self._speeds.pop(newest).speed_mps  # one observation: it must not count twice

    def _wheel(self, t_ns: int) -> float | None:
        newest = bisect_right(self._wheels, t_ns, key=lambda sample: sample.t_ns) - 1
        if newest < 0 or t_ns - self._wheels[newest].t_ns > self._max_wait_ns:
            return None
        return median(self._wheels[newest].speeds_radps)

    def _start_anew(self, t_ns: int) -> None:
        """Keep of pressures and speeds only those of the new time, which may have come before its first position."""
        self._newest_ns = None
        self._pressures = [sample for sample in self._pressures if abs(sample.t_ns - t_ns) <= HORIZON_NS]
        self._speeds = [sample for sample in self._speeds if abs(sample.t_ns - t_ns) <= HORIZON_NS]
        self._wheels = [sample for sample in self._wheels if abs(sample.t_ns - t_ns) <= HORIZON_NS]


def _insert(samples: list[Timed], sample: Timed) -> None:
    """Insert in order of stamps; drop what is spent, or everything when the stamps have jumped."""
    if samples and abs(sample.t_ns - samples[-1].t_ns) > HORIZON_NS:
        samples.clear()
    insort(samples, sample)
    while samples[-1].t_ns - samples[0].t_ns > HORIZON_NS or len(samples) > MOST:
        samples.pop(0)
