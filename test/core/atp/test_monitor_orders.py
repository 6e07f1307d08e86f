# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""All orders of what may come to a monitor, up to a depth: none leaves a train that must be braked untold for long."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import reduce

from hypothesis import given
from hypothesis import strategies as st
from test_supervision import constant

from adhesion_node.core.atp.config import SupervisionConfig
from adhesion_node.core.atp.monitor import TICKS, Event, Known, Now, Part, Refused, Rules, Tick, step
from adhesion_node.core.atp.received import StampedCurve, TrainState
from adhesion_node.core.atp.supervision import Level

START_NS = 10**12
DEPTH = 4
SLOT_S = 0.5
"""Time of one happening; the watchdogs tick once in it, unless the clock stands."""

CONFIG = SupervisionConfig(
    target_position_m=1e5,
    target_speed_kmh=0.0,
    acceleration_mps2=0.4,
    speed_margin_mps=0.0,
    position_margin_m=0.0,
    valid_for_s=1.2,
)
CLOCK_TIMEOUT_S = 0.6
SPEED_MPS, SLOWING_MPS2, BACK_S = 40.0, 0.8, 0.7
STATED_S = TICKS * SLOT_S + CONFIG.max_ahead_s
OF_CLOCK_S = CLOCK_TIMEOUT_S + SLOT_S


def place_m(t_s: float) -> float:
    """Of a train that accelerates as hard as it may."""
    return SPEED_MPS * t_s + CONFIG.acceleration_mps2 * t_s**2 / 2.0


def speed_mps(t_s: float) -> float:
    return SPEED_MPS + CONFIG.acceleration_mps2 * t_s


def needed_m(t_s: float) -> float:
    """Way to a standstill, the brake being built up 1.5 s after it is told."""
    built_up = speed_mps(t_s + CONFIG.emergency_build_up_s)
    return place_m(t_s + CONFIG.emergency_build_up_s) - place_m(t_s) + built_up**2 / (2.0 * SLOWING_MPS2)


@dataclass(frozen=True)
class World:
    """What has happened so far."""

    target_m: float
    wrong: float
    """Of the standard deviations, by how many the states are wrong."""
    t_s: float = 0.0
    known: Known = field(default_factory=lambda: Known(0))
    behind_s: float = 0.0
    """By how much the monitor's clock is."""
    stands_at_s: float | None = None
    stated_s: float = STATED_S
    free_since_s: float | None = None
    untold_s: float = 0.0
    """Longest time so far in which the train needed more way than was left, and was let go on."""

    def at(self, t_s: float, *events: Event) -> World:
        """The world after events at a time."""
        return reduce(lambda world, event: world._one(t_s, event), events, self)

    def _one(self, t_s: float, event: Event) -> World:
        clock_s = (t_s if self.stands_at_s is None else self.stands_at_s) - self.behind_s
        now = Now(START_NS + round(clock_s * 1e9), round(t_s * 1e9))
        rules = Rules(replace(CONFIG, target_position_m=self.target_m), CLOCK_TIMEOUT_S)
        known, decision = step(rules, self.known, event, now)
        world = replace(self._until(t_s), known=known, t_s=t_s)
        if decision is None:
            return world
        braked = decision.level is Level.EMERGENCY_BRAKE
        return replace(world, free_since_s=None if braked else world.free_since_s or t_s)

    def _until(self, t_s: float) -> World:
        hazard = place_m(t_s) + needed_m(t_s) > self.target_m
        if self.free_since_s is None or not hazard:
            return self
        onset_s = next(
            s / 100.0 for s in range(round(t_s * 100) + 1) if place_m(s / 100) + needed_m(s / 100) > self.target_m
        )
        return replace(self, untold_s=max(self.untold_s, t_s - max(onset_s, self.free_since_s)))


def pair(world: World, made_s: float) -> tuple[StampedCurve, TrainState]:
    stamp_ns = START_NS + round(made_s * 1e9)
    state = TrainState(
        stamp_ns,
        place_m(made_s) + world.wrong * CONFIG.margin_sigma * 2.0,
        speed_mps(made_s) + world.wrong * CONFIG.margin_sigma * 0.3,
        2.0,
        0.3,
    )
    curve = StampedCurve(stamp_ns, state.position_m, constant(state.speed_mps, deceleration_mps2=SLOWING_MPS2))
    return curve, state


def unsure(world: World) -> tuple[StampedCurve, TrainState]:
    """The first estimate after a start."""
    curve, state = pair(world, world.t_s)
    return curve, state._replace(speed_std_mps=5.0)


def target(world: World, nearer_m: float) -> World:
    return replace(world, target_m=world.target_m - nearer_m, untold_s=0.0).at(world.t_s, Tick.TARGET)


HAPPENINGS: Mapping[str, Callable[[World], World]] = {
    "silence": lambda world: world,
    "pair": lambda world: world.at(world.t_s, *pair(world, world.t_s)),
    "state alone": lambda world: world.at(world.t_s, pair(world, world.t_s)[1]),
    "curve alone": lambda world: world.at(world.t_s, pair(world, world.t_s)[0]),
    "late pair": lambda world: world.at(world.t_s, *pair(world, world.t_s - 0.7)),
    "restarted": lambda world: world.at(world.t_s, *unsure(world)),
    "nearer target": lambda world: target(world, 40.0),
    "clock back": lambda world: replace(world, behind_s=BACK_S - world.behind_s, stated_s=STATED_S + OF_CLOCK_S),
    "clock stands": lambda world: replace(world, stands_at_s=world.t_s, stated_s=STATED_S + OF_CLOCK_S),
    "state first": lambda world: world.at(world.t_s, *reversed(pair(world, world.t_s))),
    "refused state": lambda world: world.at(world.t_s, Refused(Part.STATE, "nan")),
}


def lived(world: World, happening: str, share: float = 0.5) -> World:
    """The world one slot later; its watchdogs tick at that share of it."""
    end_s = world.t_s + SLOT_S
    world = HAPPENINGS[happening](replace(world, t_s=world.t_s + 0.05))
    tick_s = world.t_s + share * (SLOT_S - 0.1)
    if world.stands_at_s is None:
        world = world.at(tick_s, Tick.ROS)
    return replace(world.at(tick_s + 0.02, Tick.STEADY), stands_at_s=None, t_s=end_s)


def begun(onset_s: float, wrong: float) -> World:
    """A monitor that has let a train go, which comes to need more way than it has left `onset_s` later."""
    far = World(1e5, wrong)
    far = far.at(0.0, *pair(far, 0.0))
    assert far.known.level is Level.NORMAL
    return target(far, 1e5 - place_m(onset_s) - needed_m(onset_s))


BOUNDED = tuple(HAPPENINGS)[:-2]
"""What is searched in all orders."""


def histories(world: World, depth: int) -> Iterator[tuple[World, tuple[str, ...]]]:
    """Every world that may come of one within so many slots, and how."""
    yield world, ()
    if depth:
        for happening in BOUNDED:
            for later, how in histories(lived(world, happening), depth - 1):
                yield later, (happening, *how)


def test_no_order_leaves_a_train_untold_for_longer_than_is_stated() -> None:
    untold, worlds = 0.0, 0
    for world, how in histories(begun(0.1, -1.0), DEPTH):
        assert world.untold_s <= world.stated_s, how
        untold, worlds = max(untold, world.untold_s), worlds + 1
    assert worlds == sum(len(BOUNDED) ** depth for depth in range(DEPTH + 1))
    assert untold > SLOT_S, "some order is tight"


@given(
    st.floats(0.0, 3.0),
    st.floats(-1.0, 1.0),
    st.lists(st.tuples(st.sampled_from(sorted(HAPPENINGS)), st.floats(0.05, 0.95)), min_size=4, max_size=14),
)
def test_no_longer_history_does_either(onset_s: float, wrong: float, how: list[tuple[str, float]]) -> None:
    world = begun(onset_s, wrong)
    for happening, share in how:
        world = lived(world, happening, share)
        assert world.untold_s <= world.stated_s
