# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What one measurement in its turn does: it is judged, and where it is good the train is followed with it."""

import math
from statistics import median

from .banked import follow_banked, last_banked
from .config import Config
from .estimate import Estimate, blind_estimate
from .intake.outcome import Event, Outcome
from .intake.plausibility import KMH_PER_MPS, believed, in_mps, is_kmh
from .intake.samples import Measurement
from .intake.standing import moving
from .state import State
from .windowed import follow_windowed, last_window

RUNNING_MPS = 5.0
"""Wheels that are all faster than this do not merely spin."""

SURE_SIGMA = 3.0
"""Standard deviations by which a speed in km/h is surely not the train's."""


def follow(config: Config, state: State, measurement: Measurement) -> tuple[State, Estimate | None]:
    """Judge the next measurement in time; follow the train with it where it is good."""
    state, measurement = _gauged(config, state, measurement)
    seen = state.seen
    turning = state.turning.after(measurement, _rims_mps(config, measurement), _may_brake(config, measurement))
    measurement, other_unit = turning.believed(measurement)
    placed = measurement.has_position
    measurement, standing, silent = moving(measurement, state.standing, state.pace)
    deceived = (turning.lies, turning.crawls) > (state.turning.lies, state.turning.crawls)
    state = state._replace(standing=standing, turning=turning).told(*silent, *other_unit)
    if placed:
        repeated = state.repeated.after(measurement, state.sure, _running_mps(config, measurement))
        if repeated.is_stuck(measurement):
            state = _stuck(state, measurement)
            if not _is_moved(config, state, measurement):
                return _unseen(config, state, measurement)
            measurement, placed = measurement._replace(variance_m2=math.inf), False
        elif repeated.is_held(measurement):
            state = state.told(Event(Outcome.HELD, f"position x = {measurement.position_m:.12g}"))
            measurement = measurement._replace(variance_m2=math.inf)
    else:
        repeated = state.repeated
    pace = state.pace.after(measurement, _shown(config, measurement))
    measurement, belied = believed(measurement, pace)
    refused: tuple[Event, ...] = ()
    if measurement.all_speeds:
        measurement, refused = in_mps(measurement, (pace.speed_mps, _surely(seen)))
    is_other = (pace.belies and not state.pace.belies) or (refused and is_kmh(state.followed_mps, pace.speed_mps))
    state = state._replace(repeated=repeated, unseen=0 if placed else state.unseen, pace=pace).told(*belied, *refused)
    if is_other or deceived:
        detail = f"speed x = {state.followed_mps:.3g}, positions at {pace.speed_mps:.3g} m/s"
        state = state.forgotten()._replace(pace=pace, standing=standing, turning=turning)
        state = state.told(Event(Outcome.RESET, detail))
    if state.method is None:
        return follow_banked(config, state, measurement)
    return follow_windowed(config, state, measurement)


def _gauged(config: Config, state: State, measurement: Measurement) -> tuple[State, Measurement]:
    """With pressures above what the gauge shows without a brake; what was believed with that for one is given up."""
    if config.pressure_kind == "demanded":
        return state, measurement
    threshold_pa, before = config.least_pressure_pa, state.zero
    zero = before.after(measurement, threshold_pa, state.seen)
    if zero is not before:
        state = state._replace(zero=zero)
        off_pa = zero.off_pa(threshold_pa)
        if off_pa > before.off_pa(threshold_pa):
            kept = state.forgotten()._replace(pace=state.pace, standing=state.standing, turning=state.turning)
            state = kept.told(Event(Outcome.RESET, f"brake_pressure x = {off_pa:.3g} Pa while no brake is applied"))
    return state, zero.corrected(measurement, threshold_pa)


def last_estimate(config: Config, state: State) -> tuple[State, tuple[Estimate, ...]]:
    """What is still to be said at the end of a time or of the data."""
    return last_banked(config, state) if state.method is None else last_window(config, state)


def _surely(seen: Estimate | None) -> float:
    """The speed of the train where it is known well enough to tell one in km/h from one that is right; else NaN."""
    wide = seen is None or SURE_SIGMA * seen.speed_std_mps > (KMH_PER_MPS - 1.0) * abs(seen.speed_mps)
    return math.nan if seen is None or wide else seen.speed_mps


def _shown(config: Config, measurement: Measurement) -> tuple[float, ...]:
    """The speeds that no sliding axle shows."""
    if config.speed_source == "axle":
        return ()
    return tuple(each.speed_mps for each in measurement.all_speeds)


def _rims_mps(config: Config, measurement: Measurement) -> tuple[float, ...]:
    """How fast the rims of wheels that turn are in the middle, at each time."""
    turning = ([abs(each) for each in sample.known_radps if each != 0.0] for sample in measurement.wheels)
    return tuple(median(each) * config.train.wheel_radius_m for each in turning if each)


def _may_brake(config: Config, measurement: Measurement) -> bool:
    """Whether wheels may slide, as a brake is applied or nothing tells of one."""
    told = [each for each in (measurement.brake_pressure_pa, measurement.demand_pa) if each is not None]
    return not told or any(map(config.is_braked, told))


def _running_mps(config: Config, measurement: Measurement) -> float:
    """How fast the train runs by its own speed, or by the wheels in the middle; 0 where these may merely spin."""
    turning = [abs(each) for each in measurement.wheels[-1].speeds_radps] if measurement.wheels else []
    found = [each * config.train.wheel_radius_m for each in turning if not math.isnan(each)]
    found = [abs(each) for each in _shown(config, measurement)] or found
    return speed if found and (speed := median(found)) > RUNNING_MPS else 0.0


def _stuck(state: State, measurement: Measurement) -> State:
    """The position is stuck: it has said nothing since it was the same for the first time."""
    event = Event(Outcome.STUCK, f"position x = {measurement.position_m:.12g}")
    return state._replace(unseen=state.unseen + 1).told(event)


def _is_moved(config: Config, state: State, measurement: Measurement) -> bool:
    """Whether another sensor tells how the train moves, also under the brake."""
    others = _shown(config, measurement) or measurement.imu or measurement.wheels
    return state.memory is not None and bool(others)


def _unseen(config: Config, state: State, measurement: Measurement) -> tuple[State, Estimate | None]:
    """As often as there are estimates, say what holds without a position."""
    before, due = state.repeated.before, state.unseen % config.step == 1 % config.step
    return state, blind_estimate(config, before.estimate, measurement.t_ns) if due and before else None
