# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Supervision limits before a target, from the braking curve, in the manner of ETCS: SUBSET-026-3, section 3.13.9.

::

    d_EBI(v) = d_EBD(V_bec) - D_bec       the emergency brake intervenes: build-up, then along the EBD to the target
    d_SBI(v) = d_EBI(v) - v T_bs          the service brake intervenes, time enough to spare the emergency brake
    d_W(v)   = d_SBI(v) - v T_warning     warning, and the traction is cut off
    d_P(v)   = d_SBI(v) - v T_driver      permitted speed
    d_I(v)   = d_P(v) - v T_indication    indication: the driver may prepare

    V_bec = max(v + V_delta0 + V_delta1, V_target) + V_delta2
    D_bec = max(v + V_delta0 + V_delta1/2, V_target) T_traction
            + (max(v + V_delta0 + V_delta1, V_target) + V_delta2/2) T_berem

EBD is the braking curve, placed so that the train has V_target + dV_ebi at the target (3.13.8.3.1), or stands there
where V_target is 0 (3.13.8.3.2); then d_SBI is also no later than SBI1, which leads by T_bs to the full service brake
(3.13.9.3.3.1).

Simplified: one target; a line speed that is the same everywhere; the gradient and the adhesion are those the braking
curve was made with; A_est and V_delta0 are parameters, not measured; no release speed, no guidance curve, no service
brake feedback; build-up times are not reduced while the brake is already building up (A.3.12 of issue 4.0.0).
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..physics.braking import BrakingCurve
from ..physics.train import Array
from . import ceiling
from .config import SupervisionConfig

GRID = 1001
"""Speeds at which the limits are tabulated, about 0.1 m/s apart; what lies between is on the safe side."""


FADING_MPS = 10.0
"""Adhesion falls by a share of 1/(v + this) per m/s at most: of the laws in `core.physics` by 1/(v + 33)."""

LEAST_SHARE = 0.25
"""Of the weakest deceleration of a curve: what it counts as, at least, at speeds above the curve's first one."""


class Limits(NamedTuple):
    """One value for each supervision limit: distances before the target, m, or speeds, m/s."""

    ebi: Array
    sbi: Array
    warning: Array
    permitted: Array
    indication: Array


EXCESS = (ceiling.EBI, ceiling.SBI, ceiling.WARNING, ceiling.NONE, ceiling.NONE)
"""What each of `Limits` adds to an allowed speed."""


def distance_between(braking: BrakingCurve, speed_mps: Array, foot_mps: float) -> Array:
    """Distance, m, along the curve from each speed to `foot_mps`; negative from a lower one.

    Between two points the deceleration counts as constant (3.13.8.1.3). A speed above the curve's first one is
    braked down to it at the curve's weakest deceleration, less what that falls by: adhesion is lower the faster a train
    is, and what a curve says of lower speeds may have been limited by the brake.
    """
    places = _along(braking, np.append(speed_mps, foot_mps))
    return np.asarray(places[-1] - places[:-1])


def _along(braking: BrakingCurve, speed_mps: Array) -> Array:
    """Place on the curve, m, where the train has a speed; before its start (negative) when faster than its first."""
    squares = braking.speed_mps[::-1] ** 2
    wanted = np.square(speed_mps)
    weakest = float(braking.deceleration_mps2.min())
    slowing = np.maximum(weakest - _fading(braking) * (speed_mps - braking.speed_mps[0]), LEAST_SHARE * weakest)
    beyond = np.maximum(wanted - squares[-1], 0.0) / (2.0 * np.minimum(slowing, weakest))
    return np.asarray(np.interp(wanted, squares, braking.distance_m[::-1]) - beyond)


def _fading(braking: BrakingCurve) -> float:
    """By how much the deceleration falls with the speed above the curve's first one, m/s^2 per m/s.

    As it does where the curve begins; at least by a share of 1/(v + `FADING_MPS`), which no adhesion law exceeds.
    """
    slowing, speed = braking.deceleration_mps2, braking.speed_mps
    least = float(slowing.min()) / (FADING_MPS + float(speed[0]))
    return max(float((slowing[1] - slowing[0]) / (speed[0] - speed[1])), least) if speed[0] > speed[1] else least


def _between_points(braking: BrakingCurve) -> float:
    """Way, m, by which a curve may err at a speed between two of its points, where v^2 falls in proportion to the way.

    Where v^2 falls by q at a deceleration from a to b, it is q (1/a - 1/b)/8 at most, if that falls first at a, then b.
    """
    slowing, squares = braking.deceleration_mps2, braking.speed_mps**2
    return float(np.max((squares[:-1] - squares[1:]) * np.abs(np.diff(1.0 / slowing)))) / 8.0


def service_curve(braking: BrakingCurve, deceleration_mps2: float) -> BrakingCurve:
    """Return the curve of a full service brake, which slows no better than `braking` at any speed."""
    slowing = np.minimum(braking.deceleration_mps2, deceleration_mps2)
    mean = (slowing[1:] + slowing[:-1]) / 2.0
    speed = braking.speed_mps
    return replace(
        braking,
        distance_m=np.concatenate(([0.0], np.cumsum((speed[:-1] ** 2 - speed[1:] ** 2) / (2.0 * mean)))),
        time_s=np.concatenate(([0.0], np.cumsum((speed[:-1] - speed[1:]) / mean))),
        deceleration_mps2=slowing,
    )


def distances(config: SupervisionConfig, braking: BrakingCurve, speed_mps: Array) -> Limits:
    """How far, m, before the target the max safe front end of a train at each speed meets each limit.

    What the curve may err by between its points counts twice: at the speed, and at the target's.
    They do not fall below 0: beyond the target the ceiling limits hold. `braking` must reach down to the target speed.
    """
    target = config.target_speed_mps
    foot = target + ceiling.EBI.above(target)
    pulled, coasted = config.speed_gain_pulling_mps, config.speed_gain_coasting_mps
    pulling = np.maximum(speed_mps + config.speed_margin_mps + pulled / 2.0, target)
    cut_off = np.maximum(speed_mps + config.speed_margin_mps + pulled, target)
    build_up = pulling * config.traction_s + (cut_off + coasted / 2.0) * config.coasting_s
    ebi = distance_between(braking, cut_off + coasted, foot) + build_up + 2.0 * _between_points(braking)
    sbi = ebi + speed_mps * config.service_build_up_s
    if target == 0.0:
        service = service_curve(braking, config.service_deceleration_mps2)
        # The service brake's curve counts from the estimated front end.
        sbi1 = distance_between(service, speed_mps, 0.0) + speed_mps * config.service_build_up_s
        sbi = np.maximum(sbi, sbi1 - config.position_margin_m)
    permitted = np.maximum(sbi + speed_mps * config.driver_time_s, 0.0)
    return Limits(
        ebi=np.maximum(ebi, 0.0),
        sbi=np.maximum(sbi, 0.0),
        warning=np.maximum(sbi + speed_mps * config.warning_time_s, 0.0),
        permitted=permitted,
        indication=permitted + speed_mps * config.indication_s,
    )


def speeds(config: SupervisionConfig, braking: BrakingCurve, distance_m: Array) -> Limits:
    """Return the speed, m/s, of each limit where the max safe front end is `distance_m` before the target.

    None is below what is allowed at the target nor above what is allowed on the line, each with its ceiling excess;
    beyond the target (a negative distance) the target speed rules.
    """
    target, line = config.target_speed_mps, config.line_speed_mps
    grid = np.linspace(0.0, line + ceiling.EBI.above(line), GRID)
    table = distances(config, braking, grid)
    return Limits(
        *(
            np.clip(_highest(grid, needed, distance_m), target + excess.above(target), line + excess.above(line))
            for needed, excess in zip(table, EXCESS, strict=True)
        )
    )


def _highest(grid: Array, needed: Array, distance_m: Array) -> Array:
    """Return the highest speed whose needed distance, which rises with speed, is there; 0 where none is."""
    # The stretch where nothing is needed has one value of distance but many speeds: its last one counts.
    first = max(int(np.searchsorted(needed, 0.0, side="right")) - 1, 0)
    return np.asarray(np.interp(distance_m, needed[first:], grid[first:], left=0.0))
