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
from typing import TYPE_CHECKING

import numpy as np

from ..belief.rail import Rail
from ..intake.outcome import Event, Outcome
from ..intake.samples import MAX_VARIANCE_M2, ImuSample, Measurement, PressureSample, SpeedSample
from ..physics.train import GRAVITY, Array
from .free import either
from .gear.brake import BrakeSeen
from .gear.radii import UNLEARNT
from .gear.slides import BRAKE_BELOW, FILLED_NS, told
from .judging import judged
from .kernels import weighing
from .labels.kinds import FREE, FREE_STD
from .labels.noises import NOISES, of_receiver
from .layout import BIAS, BRAKE, GRADE, MU, OFFSET, PITCH, POSITION, RADIUS, SCALE, SIZE, SPEED, Bank
from .memory import HALF_LOG_2PI, Memory, S, steps
from .motion import (
    Braking,
    Foreseen,
    foreseen,
    open_variance,
    slow_variance,
    slowing,
    white_variance,
    white_variances,
)
from .rims.taken import with_wheels
from .seeing import CLIPPED, SWINGING, acceleration_seen, considered, speed_seen
from .sensors.pointing import ASKEW_MPS2
from .sensors.scatter import BRAKED_FAR, PLACE_FAR, SLOW_FAR

if TYPE_CHECKING:
    from ..config import Config

GONE_ON = 3.0
"""Times the change of a gauge that may have gone on since its sample it counts as cylinders that fill: an accelerometer
takes nearly all of it for unknown, lest it take what a brake does between two samples for its bias."""

SPEED_ERROR_MPS = 0.03
"""Of any measured speed, beside what its message tells; it lasts, so that no filter makes it less."""

PITCH_MEAN, PITCH_STD, BIAS_STD = 0.09, 0.04, 0.012
"""Of an accelerometer: 0.3 to 1 degree under a full brake; mounted by hand, to within 0.7 degrees."""


def _with_position(memory: Memory, measurement: Measurement, predicted: Foreseen | None) -> Memory:
    """Take a position in; the first one places the train, with what there is of slow error in it."""
    declared, bank = math.sqrt(measurement.variance_m2), memory.bank
    off, tells = (None, False) if predicted is None else (predicted.stds, predicted.tells)
    course = memory.course.after(measurement.t_ns, measurement.position_m, memory.braked, off, tells)
    if (predicted is not None and predicted.bank is not None) or memory.is_placed:
        white = white_variances(declared, memory.coarse.std_m)
        *beliefs, total = weighing.placed(*bank[:4], white, measurement.position_m, CLIPPED)
        return memory._replace(
            bank=bank.believing(*beliefs),
            declared_m=declared,
            placed_ns=measurement.t_ns,
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
    declared = math.sqrt(measurement.variance_m2) if measurement.has_position else 1.0
    noises = of_receiver(declared)
    count = len(noises)
    mean = np.zeros((count, SIZE))
    mean[:, POSITION] = measurement.position_m if measurement.has_position else 0.0
    mean[:, SPEED], mean[:, BRAKE], mean[:, PITCH] = config.unknown_speed_mps, 1.0, PITCH_MEAN
    priors = np.log([NOISES[noise].prior for noise in noises])
    labels = np.array(noises), np.zeros(count, np.intp), np.full(count, FREE), np.zeros(count), np.zeros(count)
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
    memory = Memory(either(bank), measurement.t_ns - 1, declared)
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
    pressures, speeds = _pressures(config, memory.brake, measurement), measurement.all_speeds
    demand_pa, imu = measurement.demand_pa, measurement.imu
    memory = memory._replace(untold=measurement.brake_pressure_pa is None and demand_pa is None)
    if memory.untold:
        memory = memory._replace(brake=BrakeSeen(), braking=Braking(0.0))
    elif measurement.pressures and not memory.brake.gauged:
        memory = memory._replace(brake=memory.brake._replace(gauged=True))
    before_ns = memory.t_ns
    memory = memory._replace(left_out=()) if memory.left_out else memory
    ends = steps(before_ns, measurement.t_ns, speeds)
    ahead = None if predicted is None or len(ends) > 1 or memory.untold else predicted.bank
    for until_ns in ends:
        bank = memory.bank_at(config, until_ns) if ahead is None else ahead
        since_ns, before_ns, before = before_ns, until_ns, memory.braking
        now = [each for each in pressures if since_ns < each.t_ns <= until_ns]
        share = memory.wheels.slides.share(until_ns)
        brake = memory.brake.after(
            config, now, demand_pa, None if share is None else share < BRAKE_BELOW, measurement.demands
        )
        memory = memory._replace(
            bank=bank,
            t_ns=until_ns,
            since_s=memory.since_s + (until_ns - memory.t_ns) / S,
            brake=brake,
            braking=_braking(config, memory, brake, until_ns, demand_pa is None),
            slowed_mps=memory.slowed_mps + (memory.bank.mean_of(SPEED) - bank.mean_of(SPEED) if memory.braked else 0.0),
        )
        if imu:
            felt = [each for each in imu if since_ns < each.t_ns <= until_ns]
            braking = memory.braking._replace(applied=0.5 * (before.applied + memory.braking.applied))
            memory = _felt(config, memory, felt, braking, (until_ns - since_ns) / S) if felt else memory
        first_ns = -math.inf if until_ns == ends[0] else since_ns  # late ones count by now
        for speed in speeds:
            if first_ns < speed.t_ns <= until_ns and not (config.speed_source == "axle" and _may_slide(config, memory)):
                memory = _with_speed(config, memory, speed)
    if measurement.has_position and not memory.misled:
        memory = _with_position(memory, measurement, predicted)
    with_them = with_wheels(config, memory, measurement)
    if with_them.bank is not memory.bank and memory.is_dark:
        with_them = with_them._replace(bank=considered(memory.bank, with_them.bank, SCALE))
    return judged(config, with_them, rail)


def heard(memory: Memory, measurement: Measurement) -> tuple[Memory, Measurement]:
    """Note how the positions scatter; where that is more than they declare, it is what they err by."""
    if not measurement.has_position:
        return memory, measurement
    told = measurement.variance_m2
    places = memory.places.after(measurement.t_ns, measurement.position_m, told, far=PLACE_FAR)
    coarse = memory.coarse.after(measurement.position_m)
    memory = memory._replace(places=places, coarse=coarse)
    return memory, measurement._replace(variance_m2=places.variance_of(told))


def off(config: Config, memory: Memory, measurement: Measurement) -> Foreseen:
    """How far the measured position, if there is one, lies from what is foreseen."""
    if not (measurement.has_position and memory.is_placed):
        return Foreseen()
    before = memory.bank, (measurement.t_ns - memory.t_ns) / S, memory.braking, memory.declared_m
    white = white_variances(math.sqrt(measurement.variance_m2), memory.coarse.std_m)
    return foreseen(config, *before, measurement.position_m, white)


def _may_slide(config: Config, memory: Memory) -> bool:
    """Whether an axle may slide; where its speed is all there is, it is believed while nothing tells of a brake."""
    lingers = memory.brake.lingers(config, memory.t_ns) and not memory.is_pressed(config)
    return memory.braked or (memory.is_placed and (memory.untold or lingers))


def _with_speed(config: Config, memory: Memory, sample: SpeedSample) -> Memory:
    """Take in a speed, unless it repeats itself while the train must have slowed.

    Since one that comes late the train has slowed as it does now.
    """
    if memory.braked and sample.t_ns < memory.t_ns:
        lost_mps = slowing(config, memory.bank, memory.braking) * (memory.t_ns - sample.t_ns) / S
        sample = sample._replace(speed_mps=sample.speed_mps - lost_mps)
    told = config.speed_std_mps**2 if sample.variance is None else sample.variance
    elapsed_s, pressed = memory.speeds.quick.since_s(sample.t_ns), memory.is_pressed(config)
    repeating = memory.repeating.after(sample.speed_mps, memory.slowed_mps)
    memory = memory._replace(repeating=repeating)
    if repeating.is_stuck(memory.slowed_mps, memory.speeds.quick.variance_of(told) + SPEED_ERROR_MPS**2):
        return memory.leaving_out(Event(Outcome.STUCK, f"speed x = {sample.speed_mps:.6g}"))
    swing, far = 0.0 if pressed and memory.brake.rising else None, BRAKED_FAR if pressed else SLOW_FAR
    memory = memory._replace(speeds=memory.speeds.after(*sample[:2], told, elapsed_s, swing, far))
    variance = memory.speeds.variance_of(told, elapsed_s) + SPEED_ERROR_MPS**2
    if not memory.misled:  # else it may be a sliding axle's, too, which leaps as it rolls again
        seen = speed_seen(memory.bank, sample.speed_mps, variance)
        std = np.sqrt(weighing.variances(seen.slope, memory.bank.covariance) + variance)
        leaping, bank = memory.leaping.after(config, memory.bank, sample.t_ns, elapsed_s, seen.innovation, std)
        memory = memory._replace(leaping=leaping, bank=bank)
    return memory.told(speed_seen(memory.bank, sample.speed_mps, variance), fixes=2)


def _felt(config: Config, memory: Memory, felt: Sequence[ImuSample], braking: Braking, elapsed_s: float) -> Memory:
    """Take in the mean of some accelerations, felt in so long while the brake worked so."""
    mean = sum(each.acceleration_mps2 for each in felt) / len(felt)
    variances = [config.imu_std_mps2**2 if each.variance is None else each.variance for each in felt]
    told = sum(variances) / len(felt) ** 2
    swing = (SWINGING * config.ripple * mean) ** 2 if memory.is_pressed(config) else None
    shaking = memory.shaking.after(felt[-1].t_ns, mean, told, elapsed_s, swing)
    memory, variance = memory._replace(shaking=shaking), shaking.variance_of(told, elapsed_s)
    shown, before = felt[-1].acceleration_mps2, memory.pointing
    bias_mps2 = GRAVITY * memory.bank.mean_of(BIAS)
    if memory.braked or memory.misled:
        pointing = before.after(shown, mean, variance, elapsed_s)
    else:
        pointing = before.resting(shown, elapsed_s, bias_mps2)
    if abs(bias_mps2) > ASKEW_MPS2:
        pointing = pointing.biased(bias_mps2, GRAVITY * memory.bank.std_of(BIAS))
    memory = memory._replace(pointing=pointing)
    if pointing.lies:
        outcome = Outcome.STUCK if pointing.is_still else Outcome.ASKEW if pointing.askew else Outcome.TURNED
        return memory.leaving_out(Event(outcome, f"acceleration x = {mean:.3g}"))
    if pointing.repeats:
        return memory
    return memory.told(acceleration_seen(config, memory.bank, mean, variance, braking))


def _pressures(config: Config, brake: BrakeSeen, measurement: Measurement) -> tuple[PressureSample, ...]:
    """Pressures since the measurement before; the demand, where none is measured.

    One that is said again is none, else a dump between two samples looks like a pressure that is held; but by it the
    cylinders go on following what is demanded.
    """
    newest = measurement.demand_pa if measurement.brake_pressure_pa is None else measurement.brake_pressure_pa
    follows = measurement.demand_pa is not None or config.pressure_kind == "demanded"
    if not follows and brake.repeats(newest):
        return measurement.pressures
    return measurement.pressures or (() if newest is None else (PressureSample(measurement.t_ns, newest),))


def _braking(config: Config, memory: Memory, brake: BrakeSeen, now_ns: int, undemanded: bool) -> Braking:
    """What the brake does from now on."""
    slides, fell = memory.wheels.slides, memory.wheels.fastest.fell(now_ns)
    share, held = slides.share(now_ns), slides.share(now_ns, FILLED_NS)
    applied = config.train.specific_brake(brake.applied_pa)
    sliding = held if held is not None and held >= BRAKE_BELOW else 1.0  # no axle seen to: none does, or all as one
    follows = config.pressure_kind == "demanded" or not undemanded
    fills = follows and brake.applied_pa < brake.demanded_pa
    alone = undemanded and config.pressure_kind != "demanded"
    unseen_pa = GONE_ON * brake.unseen_pa(now_ns) if alone else 0.0
    filling = config.train.specific_brake(brake.demanded_pa if fills else unseen_pa)
    slid = told(share, brake.has_slid(now_ns), fell, slides.one_rolls(now_ns))
    return Braking(applied, sliding, brake.rising, slid, filling, alone)
