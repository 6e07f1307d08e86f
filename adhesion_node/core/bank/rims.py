# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What the wheels tell of the train's speed: unbraked they roll, under the brake the fastest mostly does."""

from __future__ import annotations

import math
from statistics import median
from typing import TYPE_CHECKING

import numpy as np

from ..intake.outcome import Event, Outcome
from ..intake.samples import Measurement, WheelSample
from .free import runs_back
from .gear.halting import Halting
from .gear.wander import Errors, Wander
from .gear.wheels import LEARNING_MPS, ROLLING, UNISON_S, UNSURE, UNTOLD_NS
from .layout import MU, RADIUS, SPEED, Bank
from .memory import Memory, S
from .motion import SLOWED, slowing
from .seeing import CLIPPED, corrected, fall_seen, speed_seen
from .stopping import halting, standing, stands

if TYPE_CHECKING:
    from ..config import Config

ROLLING_SHARE, FASTEST_SHARE = 0.02, 0.008
"""Error of the rims' speed, relative: of the middle one while no brake is applied, of the fastest under the brake."""

CREEP = 0.002
"""By how much the fastest rim is slower than the train while it rolls."""

LAGS, HELD = 0.01, 0.12
"""By how much the fastest rim may creep when axles begin to slide, at least and at most, relative: slide protection may
hold all of them at some creep, and none shows it. One that is farther behind slides, and comes back."""

SLIDES, HIDDEN = 0.2, 1e-6
"""Density of what it shows where it slides, times that error: slides last, so the next sample tells nothing new. And
while every axle is seen to roll: all of them hardly slide alike, but a brake may change that no gauge shows."""

FEW = 6
"""Rims heard; of fewer the fastest slides the likelier, the fewer they are, and where it creeps no other shows it."""

MANY = 3.0
"""Standard deviations of its speed by which a train surely runs."""

PULLED = 0.004
"""Traction over the train's weight, beyond what holds its speed on the level, from which driven axles may spin."""

SLOW_MPS = 0.5
"""Error of a rim that turns slowly or stands, as sensors tell little of it."""

TRUSTED_NS = 450_000_000
"""How often the fastest rim is taken for the train's speed, as its errors last."""

UNSEEN = 1e12
"""Variance of what is not seen."""


def with_wheels(config: Config, memory: Memory, measurement: Measurement) -> Memory:
    """Take in what the wheels told since the measurement before: which axles slide, and how fast the train is."""
    back = runs_back(memory.bank)
    if not measurement.wheels or (back and not _all_stand(config, measurement.wheels[-1])):
        return memory
    pressed = memory.is_pressed(config) or memory.braked or memory.untold or memory.wheels.fell(memory.t_ns, UNTOLD_NS)
    pressed = pressed or _is_slowed(config, memory)
    axles, wheels, newest = memory.axles, memory.wheels, measurement.wheels[-1]
    pulled = _is_pulled(config, memory.bank)
    wheels, drives = wheels._replace(pulled_ns=memory.t_ns) if pulled else wheels, pulled and not pressed
    rim, std = rim_speed(as_rolled(memory.bank, memory.wheels.wander.rolled))
    runs = not pressed and rim - MANY * std > LEARNING_MPS
    for sample in measurement.wheels:
        rims = [each * config.train.wheel_radius_m for each in sample.speeds_radps]
        axles = axles.after(rims, sample.t_ns, memory.slowed_mps, runs)
        newest = sample.without(axles.lying(memory.slowed_mps))
        wheels = wheels.after(config, newest, rim, std, pressed, drives)
    rims = wheels.rims(config, newest)
    known = rims if wheels.is_learnt else []
    wheels = wheels.agreeing(known, (1.0 - config.sliding_creep) * rim - MANY * std, newest.t_ns)
    memory = _telling(memory._replace(axles=axles, wheels=wheels))
    if memory.braked:
        return _beside_fastest(config, memory, known, newest.t_ns) if known else memory
    memory, rolls = _unbraked(config, memory, rims, newest.t_ns, rim - MANY * std), wheels.rolling(rims, drives)
    if rolls > LEARNING_MPS:
        return _spinning(memory, rolls, len(rims)) if drives and MANY * std < rim else _rolling(memory, rolls, pressed)
    dark = memory.asks and not measurement.has_position and rims
    return _slow(memory, max(rims) if pressed else rolls, back) if dark else memory


def _is_pulled(config: Config, bank: Bank) -> bool:
    """Whether traction does more than hold the speed on the level, so that driven axles may spin."""
    return -bank.mean_of(MU) > PULLED + float(config.train.specific_resistance(bank.mean_of(SPEED)))


def _all_stand(config: Config, sample: WheelSample) -> bool:
    """Whether no wheel that is heard turns: that says the same of a train that runs back."""
    rims = [each * config.train.wheel_radius_m for each in sample.known_radps]
    return bool(rims) and max(map(abs, rims)) < SLOW_MPS


def _is_slowed(config: Config, memory: Memory) -> bool:
    """Whether wheels may slide though no brake is applied: it still lets go, or another one slows the train down."""
    used = memory.bank.mean_of(MU)
    slowed = used > SLOWED and memory.braking.alone and not memory.wheels.agree(memory.t_ns)  # else it is a grade
    return slowed or (used > -SLOWED and memory.brake.lingers(config, memory.t_ns))


def _unbraked(config: Config, memory: Memory, rims: list[float], t_ns: int, least_mps: float) -> Memory:
    """No braking is open: the fastest rim will not be believed before all might have slid, radii are what they were.

    A spin that ends leaves rims as fast as the train, by what is known of it `least_mps`; a slide that begins does not.
    """
    learnt, trusted_ns = memory.wheels.is_learnt, memory.t_ns + round((config.brake_build_up_s + UNISON_S) * S)
    sure = rims and learnt and (median(rims) < least_mps or not memory.wheels.may_spin(t_ns))
    wheels = memory.wheels.beside(median(rims), t_ns) if sure else memory.wheels
    return memory._replace(
        bank=as_rolled(memory.bank, memory.wheels.wander.rolled),
        wheels=wheels._replace(
            trusted_ns=trusted_ns, risen=False, lowest_mps=math.inf, fall_mps2=0.0, wander=Wander(), halting=Halting()
        ),
    )


def _rolling(memory: Memory, rim_mps: float, pressed: bool) -> Memory:
    """Take in how fast a rim is that rolls; where it may slide, the train is not slower than that.

    While nothing is learnt of them it may lie between such as turn and such as are dead.
    """
    if not memory.wheels.is_learnt:
        return memory
    bank = not_slower(memory.bank, rim_mps, FASTEST_SHARE * rim_mps) if pressed else rolling(memory.bank, rim_mps)
    return memory._replace(bank=bank.normalised(), fixes=memory.fixes + 1)


def _spinning(memory: Memory, rim_mps: float, count: int) -> Memory:
    """Take in how fast the slowest of so many rims is while the train is pulled: as the train, or it spins, too.

    Of radii that tells nothing.
    """
    if not memory.wheels.is_learnt:
        return memory
    bank = as_fast(memory.bank, rim_mps, ROLLING_SHARE * rim_mps, _slides(count)).normalised()
    return memory._replace(bank=_of_radii_nothing(memory.bank, bank), fixes=memory.fixes + 1)


def _slow(memory: Memory, rim_mps: float, back: bool) -> Memory:
    """Take in how slow a rim is: as the train, or it is locked, or dead. Unless it runs back the train is no slower.

    Of radii that tells nothing.
    """
    bank = memory.bank if back else not_slower(memory.bank, rim_mps, SLOW_MPS)
    return memory._replace(bank=_of_radii_nothing(memory.bank, as_fast(bank, rim_mps, SLOW_MPS).normalised()))


def _of_radii_nothing(before: Bank, bank: Bank) -> Bank:
    """The bank with radii as they were known before: they are considered, not estimated (Schmidt 1966)."""
    variance = before.covariance[:, RADIUS, RADIUS]
    bank.mean[:, RADIUS], bank.covariance[:, RADIUS, RADIUS] = before.mean[:, RADIUS], variance
    return bank


def _telling(memory: Memory) -> Memory:
    lying = memory.axles.lying(memory.slowed_mps)
    names = ", ".join(str(axle + 1) for axle in lying)
    return memory.leaving_out(Event(Outcome.STUCK, f"wheel_speed of axle {names}")) if lying else memory


def _beside_fastest(config: Config, memory: Memory, rims: list[float], t_ns: int) -> Memory:
    """Take in under the brake how fast the fastest rim was at a time, from which on it has slowed as the train has."""
    bank = memory.bank
    rim_mps = memory.wheels.fastest(rims) - slowing(config, bank, memory.braking) * (memory.t_ns - t_ns) / S
    memory = halting(config, memory, rims, t_ns)
    if stands(config, memory):
        return standing(memory)
    if rim_mps <= config.slowest_mps:
        return memory
    bank, wheels = not_slower(bank, rim_mps, FASTEST_SHARE * rim_mps), memory.wheels.beside(rim_mps, memory.t_ns)
    if wheels.fall_mps2 > memory.wheels.fall_mps2:
        bank = fall_seen(config, bank.normalised(), memory.braking, wheels.fall_mps2)
    if memory.t_ns >= wheels.trusted_ns:
        wander, errors = wheels.wander.after(memory.t_ns, rim_mps), Errors()
        if memory.braking.told > 0.0:
            bank, wander, errors = _creeping(bank, wander, rim_mps)
        roll = memory.braking.told < 0.0 or (_tells_of_none(config, memory) and wheels.all_roll(t_ns))
        slides = HIDDEN if roll and len(rims) >= FEW else _slides(len(rims))
        bank = as_fast(bank, rim_mps, errors.quick * rim_mps, slides)
        wheels = wheels._replace(trusted_ns=memory.t_ns + TRUSTED_NS, wander=wander)
    return memory._replace(wheels=wheels, bank=bank.normalised())


def _tells_of_none(config: Config, memory: Memory) -> bool:
    """Whether the speed is known too badly to tell of any axle whether it slides: such as do would differ."""
    mean, std = memory.bank.mean_of(SPEED), memory.bank.std_of(SPEED)
    return memory.braking.told == 0.0 and UNSURE * std > ROLLING * config.sliding_creep * mean


def _slides(count: int) -> float:
    """Density of what the fastest of so many rims shows where it slides."""
    return SLIDES * max(FEW / count, 1.0)


def rim_speed(bank: Bank) -> tuple[float, float]:
    """Speed of a rim that rolls, as radii are expected, and its standard deviation, m/s."""
    mean, covariance = bank.moments()
    slope = np.array([1.0 + mean[RADIUS], mean[SPEED]])
    both = covariance[np.ix_((SPEED, RADIUS), (SPEED, RADIUS))]
    return float(slope[0] * mean[SPEED]), math.sqrt(max(float(slope @ both @ slope), 0.0))


def as_rolled(bank: Bank, rolled: tuple[float, float] | None) -> Bank:
    """Where axles have slid: radii are again what they were, and their variance, before all of them crept."""
    if rolled is None:
        return bank
    mean, covariance = bank.mean.copy(), bank.covariance.copy()
    covariance[:, RADIUS, :] = covariance[:, :, RADIUS] = 0.0
    mean[:, RADIUS], covariance[:, RADIUS, RADIUS] = rolled
    return bank._replace(mean=mean, covariance=covariance)


def rolling(bank: Bank, rim_mps: float) -> Bank:
    """Take in the speed of the middle rim while no brake is applied. The weights are not normalised.

    How far radii matter is told by what is measured, as the speed may be hardly known.
    """
    seen = speed_seen(bank, rim_mps, (ROLLING_SHARE * rim_mps) ** 2, RADIUS)
    seen.slope[:, RADIUS] = rim_mps / (1.0 + bank.mean[:, RADIUS])
    return corrected(bank, seen)


def not_slower(bank: Bank, rim_mps: float, std: float) -> Bank:
    """Take in that no rim is faster than the train but for an error, m/s: only what contradicts it is corrected."""
    seen = speed_seen(bank, rim_mps, std**2, RADIUS)
    slower = seen.innovation > 0.0
    after = corrected(bank, seen._replace(variance=np.where(slower, std**2, UNSEEN)))
    squared = np.minimum(seen.innovation / std, CLIPPED) ** 2
    return after._replace(log_weight=bank.log_weight - np.where(slower, 0.5 * squared, 0.0))


def _creeping(bank: Bank, wander: Wander, rim_mps: float) -> tuple[Bank, Wander, Errors]:
    """Axles slide, so the fastest rim may creep: it is as if all radii were others, by what wanders, and how it errs.

    At first it may creep by all that it is behind.
    """
    mean, before = bank.moments()
    errors, covariance = wander.errors(float(mean[RADIUS])), bank.covariance.copy()
    variance, behind = errors.lasting * TRUSTED_NS / S, 1.0 - rim_mps / max(rim_speed(bank)[0], rim_mps)
    if wander.rolled is None and behind < HELD:
        wander = wander._replace(rolled=(float(mean[RADIUS]), float(before[RADIUS, RADIUS])))
        variance = LAGS**2 + behind**2
    covariance[:, RADIUS, RADIUS] += variance
    return bank._replace(covariance=covariance), wander, errors


def as_fast(bank: Bank, rim_mps: float, error: float, slides: float = SLIDES) -> Bank:
    """Take in that a rim is as fast as the train but for an error, m/s, or slides.

    Each Gaussian becomes the one with the moments of both (probabilistic data association, Bar-Shalom and Tse 1975).
    The weights are not normalised.
    """
    seen = speed_seen(bank, rim_mps * (1.0 + CREEP), error**2, RADIUS)
    gain = np.einsum("hij,hj->hi", bank.covariance, seen.slope)
    std = np.sqrt(np.einsum("hi,hi->h", gain, seen.slope) + error**2)
    off, gain = seen.innovation / std, gain / std[:, None]
    rolled = np.exp(-0.5 * off**2) / (math.sqrt(2.0 * math.pi) * std)
    total = rolled + slides / error
    part = rolled / total
    narrower = part * (1.0 - (1.0 - part) * off**2)
    return bank._replace(
        mean=bank.mean + gain * (part * off)[:, None],
        covariance=bank.covariance - narrower[:, None, None] * gain[:, :, None] * gain[:, None, :],
        log_weight=bank.log_weight + np.log(total),
    )
