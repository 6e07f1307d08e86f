# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""One measurement in its turn: the bank is moved on from sample to sample of all sensors, and takes each in."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from statistics import median
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..belief.rail import Rail
from ..intake.samples import MAX_VARIANCE_M2, ImuSample, Measurement, PressureSample, SpeedSample
from ..physics.train import GRAVITY, Array
from ..quick import quick
from .brake import BrakeSeen
from .branching import branched, closed, opened, pruned, unlikely_kept
from .kernels import weighing
from .kinds import FREE, FREE_STD, HELD, NOISES, PASSING, SLIDES
from .layout import BIAS, BRAKE, GRADE, MU, OFFSET, PITCH, POSITION, RADIUS, SCALE, SIZE, SPEED, Bank
from .motion import Braking, Foreseen, foreseen, moved, open_variance, resistance, slow_variance, use, white_variance
from .plausible import Course
from .rims import as_fast, not_slower, rim_speed, rolling
from .seeing import (
    CLIPPED,
    Observation,
    acceleration_seen,
    corrected,
    position_seen,
    speed_seen,
    wheels_seen,
)
from .wheels import LEARNING_MPS, UNLEARNT, WheelsSeen, told

if TYPE_CHECKING:
    from ..config import Config

S = 1_000_000_000

HALF_LOG_2PI = 0.5 * math.log(2.0 * math.pi)

BRANCH_S = 0.5
"""How often it is asked whether rail or limit have changed."""

STEP_S = 0.2
"""Longest step in time."""

SPEED_ERROR_MPS = 0.03
"""Of any measured speed, beside what its message tells; it lasts, so that no filter makes it less."""

PAST_NS = 4 * S
"""How far back it can go."""

DOUBTED, PASSED, CERTAIN, CHANGED = 0.1, 0.5, 0.99, 0.2
"""Probabilities from which a change of the rail is in doubt, up to which it still goes on, and from which it is told,
and by how much it must have changed."""

SETTLING_S = 6.0
"""For so long, and the brake's build-up, behind its opening a braking tells no change."""

SLID = 0.9
"""Probability from which axles slid."""

UNISON_S = 3.0
"""For so long, and the brake's build-up, behind the opening all axles may begin to slide as one."""

TRUSTED_NS = 450_000_000
"""How often the fastest rim is taken for the train's speed, as its errors last."""

FORGOTTEN = 0.02
"""Least probability of how positions err while no brake is applied: sensors change, and unknown traction looks like an
error that wanders."""

PITCH_MEAN, PITCH_STD, BIAS_STD = 0.08, 0.08, 0.005
"""Of an accelerometer: 0.3 to 1 degree under a full brake, 0.05 m/s^2."""


@quick
class Memory(NamedTuple):
    """What the bank remembers."""

    bank: Bank
    t_ns: int
    declared_m: float
    """Standard deviation that the last position declared."""
    brake: BrakeSeen = BrakeSeen()
    wheels: WheelsSeen = WheelsSeen()
    braking: Braking = Braking(0.0)
    since_s: float = 0.0
    """Since it was last asked what has changed."""
    known: Rail = Rail(0.0, 1.0, 0.0)
    """The rail as it was known when the braking began."""
    told_s: float = 0.0
    """When a change of the rail was told last; it is later ones that are told."""
    changes: int = 0
    """Changes of the rail told."""
    steady: tuple[Bank, Braking] | None = None
    """What was believed when none was in doubt, ..."""
    slid: bool = False
    """... and whether axles slid then."""
    course: Course = Course()
    past: tuple[tuple[int, Bank], ...] = ()
    """Beliefs of some seconds ago, to go back to where positions turn out to be wrong."""
    misled: bool = False
    """Whether the positions are those of a sliding wheel: they are left out until the brake is released."""
    seen: int = 0
    """Measurements of the present braking; 0 while there is none."""
    fixes: int = 0
    """Positions taken in; a speed counts as two, as it takes two positions to tell one."""
    log_likelihood: float = 0.0
    """Sum of ln p of what positions, speeds and accelerometer told since the last estimate, in m, m/s and g."""

    @property
    def braked(self) -> bool:
        """Whether a braking is open."""
        return self.seen > 0

    @property
    def is_placed(self) -> bool:
        """Whether any position has said where the train is."""
        return bool(self.bank.covariance[0, POSITION, POSITION] < 0.5 * MAX_VARIANCE_M2)

    def told(self, seen: Observation, fixes: int = 0) -> Memory:
        """Take in an observation."""
        bank = corrected(self.bank, seen)
        total = weighing.total(bank.log_weight)
        return self._replace(
            bank=bank.believing(bank.mean, bank.covariance, bank.log_weight - total),
            fixes=self.fixes + fixes,
            log_likelihood=self.log_likelihood + total - HALF_LOG_2PI,
        )


def _with_position(memory: Memory, measurement: Measurement, predicted: Foreseen | None) -> Memory:
    """Take a position in; the first one places the train, with what there is of slow error in it."""
    declared, bank = math.sqrt(measurement.variance_m2), memory.bank
    off = None if predicted is None else predicted.stds
    course = memory.course.after(measurement.t_ns, measurement.position_m, memory.braked, off)
    known = predicted if predicted is not None and predicted.bank is bank else None
    if known is not None or memory.is_placed:
        if known is not None:
            innovation, white = known.innovation, known.white
        else:
            seen = position_seen(bank, measurement.position_m, declared)
            innovation, white = seen.innovation, seen.variances
        *beliefs, total = weighing.placed(bank.mean, bank.covariance, bank.log_weight, innovation, white, CLIPPED)
        return memory._replace(
            bank=bank.believing(*beliefs),
            declared_m=declared,
            course=course,
            fixes=memory.fixes + 1,
            log_likelihood=memory.log_likelihood + total - HALF_LOG_2PI,
        )
    slow = slow_variance(bank, declared)
    placed = bank.with_fresh(POSITION, measurement.position_m, np.sqrt(white_variance(bank, declared) + slow))
    placed = placed.with_fresh(OFFSET, 0.0, np.sqrt(slow))
    placed.covariance[:, POSITION, OFFSET] = placed.covariance[:, OFFSET, POSITION] = -slow
    return memory._replace(bank=placed, declared_m=declared, course=course, fixes=memory.fixes + 1)


def met(config: Config, measurement: Measurement) -> Memory:
    """A train just met: its position is known, if it was measured, of its speed only how large it may be."""
    count = len(NOISES)
    declared = math.sqrt(measurement.variance_m2) if measurement.has_position else 1.0
    mean = np.zeros((count, SIZE))
    mean[:, POSITION] = measurement.position_m if measurement.has_position else 0.0
    mean[:, SPEED], mean[:, BRAKE], mean[:, PITCH] = config.unknown_speed_mps, 1.0, PITCH_MEAN
    priors = np.log([noise.prior for noise in NOISES])
    labels = np.arange(count), np.zeros(count, np.intp), np.full(count, FREE), np.zeros(count), np.zeros(count)
    bank = Bank(mean, np.zeros((count, SIZE, SIZE)), priors, *labels)
    variances: dict[int, float | Array] = {
        POSITION: MAX_VARIANCE_M2,
        SPEED: config.unknown_speed_mps**2,
        MU: (3.0 * FREE_STD) ** 2,  # it may be in the midst of the strongest traction
        BRAKE: config.brake_error**2,
        GRADE: open_variance(config, bank),
        OFFSET: slow_variance(bank, declared),
        BIAS: BIAS_STD**2,
        PITCH: PITCH_STD**2,
        SCALE: config.speed_scale_std**2,
        RADIUS: UNLEARNT**2,
    }
    for component, variance in variances.items():
        bank.covariance[:, component, component] = variance
    memory = Memory(bank.normalised(), measurement.t_ns - 1, declared)
    return followed(config, memory, measurement, lambda: Rail(0.0, 1.0, 0.0))


def followed(
    config: Config,
    memory: Memory,
    measurement: Measurement,
    rail: Callable[[], Rail],
    predicted: Foreseen | None = None,
) -> Memory:
    """The train followed up to a measurement, which is taken in.

    `rail` is asked for where a braking opens; `predicted` is what `off` has said of the measurement, if that is known.
    """
    pressures, speeds, start = _pressures(measurement), _speeds(config, measurement), memory
    if measurement.brake_pressure_pa is None and measurement.demand_pa is None:
        memory = memory._replace(brake=BrakeSeen(), braking=Braking(0.0))
    before_ns = memory.t_ns
    for until_ns in _steps(before_ns, measurement.t_ns, speeds):
        ahead = predicted.bank if predicted is not None and until_ns == measurement.t_ns else None
        bank = _bank_at(config, memory, until_ns) if ahead is None or memory is not start else ahead
        since_ns, before_ns, braking = before_ns, until_ns, memory.braking
        now = [each for each in pressures if since_ns < each.t_ns <= until_ns]
        brake = memory.brake.after(config, now, measurement.demand_pa)
        memory = memory._replace(
            bank=bank,
            t_ns=until_ns,
            since_s=memory.since_s + (until_ns - memory.t_ns) / S,
            brake=brake,
            braking=_braking(config, memory, brake, until_ns),
        )
        if measurement.imu:
            felt = [each for each in measurement.imu if since_ns < each.t_ns <= until_ns]
            memory = _felt(config, memory, felt, braking) if felt else memory
        for speed in speeds:
            if since_ns < speed.t_ns <= until_ns and (config.speed_source != "axle" or not memory.braked):
                variance = config.speed_std_mps**2 if speed.variance is None else speed.variance
                seen = speed_seen(memory.bank, speed.speed_mps, variance + SPEED_ERROR_MPS**2)
                memory = memory.told(seen, fixes=2)
    if measurement.has_position and not memory.misled:
        memory = _with_position(memory, measurement, predicted)
    return _judged(config, _with_wheels(config, memory, measurement), rail)


def off(config: Config, memory: Memory, measurement: Measurement) -> Foreseen:
    """How far the measured position, if there is one, lies from what is foreseen."""
    if not (measurement.has_position and memory.is_placed):
        return Foreseen()
    before = memory.bank, (measurement.t_ns - memory.t_ns) / S, memory.braking, memory.declared_m
    return foreseen(config, *before, measurement.position_m, math.sqrt(measurement.variance_m2))


def _steps(from_ns: int, to_ns: int, speeds: Sequence[SpeedSample] = ()) -> Sequence[int]:
    """Ends of the steps up to a time: where speeds were measured, and no step too long."""
    if not speeds and to_ns - from_ns <= STEP_S * S:
        return (to_ns,)
    ends: list[int] = []
    for until_ns in (*sorted({each.t_ns for each in speeds if from_ns < each.t_ns < to_ns}), to_ns):
        count = max(math.ceil((until_ns - from_ns) / (STEP_S * S)), 1)
        ends += [from_ns + (until_ns - from_ns) * index // count for index in range(1, count + 1)]
        from_ns = until_ns
    return ends


def _bank_at(config: Config, memory: Memory, until_ns: int) -> Bank:
    if until_ns <= memory.t_ns:
        return memory.bank
    return moved(config, memory.bank, (until_ns - memory.t_ns) / S, memory.braking, memory.declared_m)


def _felt(config: Config, memory: Memory, felt: Sequence[ImuSample], braking: Braking) -> Memory:
    """Take in the mean of some accelerations, felt while the brake worked so."""
    mean = sum(each.acceleration_mps2 for each in felt) / len(felt)
    variances = [config.imu_std_mps2**2 if each.variance is None else each.variance for each in felt]
    variance = sum(variances) / len(felt) ** 2
    return memory.told(acceleration_seen(config, memory.bank, mean, variance, braking))


def _pressures(measurement: Measurement) -> tuple[PressureSample, ...]:
    """Pressures since the measurement before; the demand, where none is measured."""
    newest = measurement.demand_pa if measurement.brake_pressure_pa is None else measurement.brake_pressure_pa
    return measurement.pressures or (() if newest is None else (PressureSample(measurement.t_ns, newest),))


def _speeds(config: Config, measurement: Measurement) -> tuple[SpeedSample, ...]:
    """Speeds since the measurement before."""
    alone = measurement.speed_mps
    return measurement.speeds or (() if alone is None else (SpeedSample(measurement.t_ns, alone),))


def _braking(config: Config, memory: Memory, brake: BrakeSeen, now_ns: int) -> Braking:
    """What the brake does from now on."""
    share = memory.wheels.share(now_ns)
    applied = config.train.specific_brake(brake.applied_pa)
    return Braking(applied, 1.0 if share is None else share, brake.rising, told(share, brake.has_slid(now_ns)))


def _is_pressed(config: Config, memory: Memory) -> bool:
    return memory.brake.demanded_pa >= max(config.brake_threshold_pa, 1.0)


def _with_wheels(config: Config, memory: Memory, measurement: Measurement) -> Memory:
    if not measurement.wheels:
        return memory
    pressed, wheels, newest = _is_pressed(config, memory), memory.wheels, measurement.wheels[-1]
    rim, std = rim_speed(memory.bank)
    for sample in measurement.wheels:
        wheels = wheels.after(config, sample, rim, std, pressed)
    rims, memory = wheels.rims(config, newest), memory._replace(wheels=wheels)
    if rims and memory.braked:
        return _beside_fastest(config, memory, wheels.fastest(rims), newest.t_ns)
    trusted_ns = memory.t_ns + round((config.brake_build_up_s + UNISON_S) * S)
    memory = memory._replace(wheels=wheels._replace(trusted_ns=trusted_ns, risen=False, lowest_mps=math.inf))
    if rims and not pressed and rim > LEARNING_MPS:
        return memory._replace(bank=rolling(memory.bank, median(rims)).normalised())
    return memory


def _beside_fastest(config: Config, memory: Memory, rim_mps: float, t_ns: int) -> Memory:
    """Take in under the brake how fast the fastest rim was at a time, from which on it has slowed as the train has."""
    bank, resisting = memory.bank, resistance(config, memory.bank)
    slowing = GRAVITY * float(bank.weight @ (use(config, bank, memory.braking, resisting).value + resisting))
    rim_mps -= slowing * (memory.t_ns - t_ns) / S
    if rim_mps <= config.slowest_mps:
        return memory
    bank, wheels = not_slower(bank, rim_mps), memory.wheels.beside(rim_mps, memory.t_ns)
    if memory.t_ns >= wheels.trusted_ns:
        bank, wheels = as_fast(bank, rim_mps), wheels._replace(trusted_ns=memory.t_ns + TRUSTED_NS)
    return memory._replace(wheels=wheels, bank=bank.normalised())


def _judged(config: Config, memory: Memory, rail: Callable[[], Rail]) -> Memory:
    """Open or close a braking, ask what has changed, weigh what wheels and slide protection tell."""
    bank, now_s = memory.bank, memory.t_ns / S
    pressed = _is_pressed(config, memory)
    if memory.misled:
        return memory if pressed else _led_again(memory)
    braked = pressed and bank.mean_of(SPEED) >= config.slowest_mps
    if braked and not memory.braked:
        known = rail()
        told_s = now_s + SETTLING_S + config.brake_build_up_s
        return memory._replace(bank=opened(config, bank, known), since_s=0.0, seen=1, told_s=told_s, known=known)
    if memory.braked and not braked:
        return memory._replace(bank=closed(bank), seen=0)
    if not memory.braked:  # one hypothesis has nothing beside it that could be forgotten
        return memory if bank.kind.size == 1 else memory._replace(bank=unlikely_kept(bank, FORGOTTEN))
    if memory.since_s >= BRANCH_S - 1e-6:
        if memory.course.is_impossible(config, bank, memory.declared_m):
            return misled(config, memory)
        if memory.braking.told:
            bank = wheels_seen(config, bank, memory.braking, memory.since_s).normalised()
        bank = branched(config, bank, memory.braking, now_s, memory.since_s)
        kept = tuple(each for each in memory.past if memory.t_ns - each[0] <= PAST_NS)
        memory = memory._replace(since_s=0.0, past=(*kept, (memory.t_ns, bank)))
    return _with_changes(config, memory, pruned(bank))


def misled(config: Config, memory: Memory) -> Memory:
    """The positions were those of a sliding wheel: go back to before, and on without them, whatever the brake does."""
    t_ns, bank = memory.past[0] if memory.past else (memory.t_ns, memory.bank)
    half = 0.5 * config.train.specific_brake(memory.brake.demanded_pa)
    before = memory._replace(bank=closed(bank).with_fresh(MU, half, half), t_ns=t_ns, seen=0, past=())
    ahead = before
    for until_ns in _steps(t_ns, memory.t_ns):
        ahead = ahead._replace(bank=_bank_at(config, ahead, until_ns), t_ns=until_ns)
    return ahead._replace(misled=True, since_s=0.0)


def _led_again(memory: Memory) -> Memory:
    """The brake is released, no wheel slides any more: positions count again, wherever they say that the train is."""
    bank = memory.bank.with_fresh(POSITION, memory.bank.mean[:, POSITION], math.sqrt(MAX_VARIANCE_M2))
    return memory._replace(bank=bank, misled=False, course=Course())


def _with_changes(config: Config, memory: Memory, bank: Bank) -> Memory:
    """Tell a change of the rail once it is certain and passed, and the adhesion used another than before any doubt.

    That axles roll, where they slid before, is one, too. While the brake may still build up, or the border of the last
    one lies under the train, none is told.
    """
    now_s, held, seen = memory.t_ns / S, HELD if memory.slid else PASSING, memory.seen + 1
    changed, passing, sliding = weighing.changing(
        bank.log_weight, bank.changed_s, bank.kind, SLIDES, memory.told_s + 1e-6, PASSING, held
    )
    settling = now_s < memory.told_s
    if not settling and (DOUBTED <= changed < CERTAIN or passing > PASSED):
        return memory._replace(bank=bank, seen=seen)
    steady, slid = (bank, memory.braking), sliding > SLID
    if settling or changed < DOUBTED:
        return memory._replace(bank=bank, seen=seen, steady=steady, slid=slid)
    before = 0.0 if memory.steady is None else _used(config, *memory.steady)
    changes = memory.changes + (abs(_used(config, *steady) - before) > CHANGED * before)
    passed_s = now_s + config.train.length_m / max(bank.mean_of(SPEED), config.slowest_mps)
    return memory._replace(bank=bank, seen=seen, told_s=passed_s, changes=changes, steady=steady, slid=slid)


def _used(config: Config, bank: Bank, braking: Braking) -> float:
    """Adhesion that is used, over all hypotheses."""
    return float(bank.weight @ use(config, bank, braking, resistance(config, bank)).value)
