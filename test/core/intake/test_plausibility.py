# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What is refused although it is well formed: a stuck sensor, a flood, km/h; and time that goes back a little."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import trapezoid

from adhesion_node.core import Config, Outcome
from adhesion_node.core.intake.plausibility import STRONGEST_MPS2, least_way
from adhesion_node.core.intake.samples import PositionSample, PressureSample, Sample, SpeedSample
from adhesion_node.core.physics.adhesion import SNOW
from adhesion_node.core.prediction import Prediction
from adhesion_node.run.pipeline import Pipeline
from sim_node.train.run import run
from sim_node.train.scenario import find
from sim_node.train.sensors import ATMOSPHERE_PA

S = 10**9
FAST = Config(iterations=3, particles=10)


def ride(begin_s: float, end_s: float, rate_hz: float = 10.0, scenario: str = "tunnel_entry") -> list[Sample]:
    """Pressures and positions of a simulated run; the brake comes on at 20 s."""
    samples: list[Sample] = []
    for _, r in run(find(scenario), 1.0 / rate_hz, 1):
        if begin_s * S <= r.t_ns < end_s * S and r.position_m is not None:
            samples.append(PressureSample(r.t_ns, r.pressure_pa - ATMOSPHERE_PA))
            samples.append(PositionSample(r.t_ns, r.position_m, 0.25))
    return samples


def stuck(samples: Sequence[Sample], from_s: float, until_s: float = 1e9) -> list[Sample]:
    held = next(s.position_m for s in samples if isinstance(s, PositionSample) and s.t_ns >= from_s * S)
    return [
        s._replace(position_m=held) if isinstance(s, PositionSample) and from_s * S <= s.t_ns < until_s * S else s
        for s in samples
    ]


def feed(pipeline: Pipeline, samples: Iterable[Sample]) -> list[Prediction]:
    return [prediction for sample in samples for prediction in pipeline.push(sample)]


@pytest.mark.parametrize("rate_hz", [5.0, 10.0, 50.0])
def test_a_stuck_position_is_told_within_2_s(rate_hz: float) -> None:
    pipeline = Pipeline(FAST, 1)
    told_ns = 0
    for sample in stuck(ride(10.0, 34.0, rate_hz), 30.0):
        pipeline.push(sample)
        told_ns = told_ns or (sample.t_ns if pipeline.state.stuck else 0)
    assert 30.0 < told_ns / S < 32.0


@pytest.mark.parametrize("deceleration", [0.0, 0.6])
@pytest.mark.parametrize("rate_hz", [5, 10, 50])
def test_a_slow_train_whose_position_is_stuck_is_told_within_2_s(rate_hz: int, deceleration: float) -> None:
    """6.5 m/s when it sticks at 24 s, with the brake on since 20 s where it brakes."""
    pipeline, told_s = Pipeline(FAST, 1), 0.0
    for t_s, sample in slow(rate_hz, 6.5 + 4.0 * deceleration, deceleration, 0.0):
        sticks = isinstance(sample, PositionSample) and t_s >= 24.0
        pipeline.push(PositionSample(sample.t_ns, 100.0, 0.25) if sticks else sample)
        told_s = told_s or (t_s if pipeline.state.stuck else 0.0)
    assert 24.0 < told_s < 26.0


def slow(rate_hz: int, speed_mps: float, deceleration: float, step_m: float) -> Iterator[tuple[float, Sample]]:
    """30 s of a slow train that brakes from 20 s on, measured with 0.5 m of noise and, above 0, in steps."""
    rng, place_m = np.random.default_rng(1), 0.0
    for tick in range(30 * rate_hz):
        t_s = tick / rate_hz
        braked = t_s >= 20.0 and deceleration > 0.0
        speed_mps = max(speed_mps - braked * deceleration / rate_hz, 0.0)
        place_m += speed_mps / rate_hz
        shown_m = place_m + 0.5 * float(rng.standard_normal()) * (step_m == 0.0)
        yield t_s, PressureSample(round(t_s * S), 410e3 * braked)
        yield t_s, PositionSample(round(t_s * S), round(shown_m / step_m) * step_m if step_m else shown_m, 0.25)


@pytest.mark.parametrize("rate_hz", [10, 50])
@pytest.mark.parametrize("speed_mps", [2.0, 6.0, 12.0])
def test_a_slow_train_with_a_coarse_sensor_is_not_stuck(rate_hz: int, speed_mps: float) -> None:
    """Steps of 1.7 m, as many as a standard deviation of 0.5 m may stand for; it brakes to a stand."""
    pipeline = Pipeline(FAST, 1)
    for _, sample in slow(rate_hz, speed_mps, 0.7, 1.7):
        pipeline.push(sample)
        assert not pipeline.state.stuck


def test_while_it_is_stuck_mu_is_withheld_and_the_curve_falls_back_to_the_low_law() -> None:
    pipeline = Pipeline(FAST, 1)
    predictions = feed(pipeline, stuck(ride(10.0, 40.0), 30.0))
    seen = [p.estimate for p in predictions if not p.estimate.withheld][-1]
    blind = [p for p in predictions if p.estimate.withheld]
    assert len(blind) == pytest.approx(95 / FAST.step, abs=1.0)  # as often as there are estimates
    truth = {t.t_ns: t for t, _ in run(find("tunnel_entry"), 0.1, 1)}
    for prediction in blind:
        estimate, true = prediction.estimate, truth[prediction.estimate.t_ns]
        assert prediction.nominal is None
        assert prediction.safe is not None
        assert estimate.mu == pytest.approx(float(SNOW(np.array(seen.speed_mps))), rel=0.01)
        assert estimate.mu_lower == FAST.lowest_mu
        assert estimate.ahead is None  # else the curve would go on with what was identified
        assert prediction.safe.speed_mps[0] >= true.speed_mps
        assert estimate.position_m >= true.position_m - 3.0 * estimate.position_std_m
    stamps = [p.estimate.t_ns for p in predictions]
    assert stamps == sorted(set(stamps))
    assert pipeline.dropped["STUCK"] > 80


def test_a_sensor_that_recovers_is_used_again() -> None:
    pipeline = Pipeline(FAST, 1)
    feed(pipeline, stuck(ride(10.0, 50.0), 30.0, 35.0))
    assert not pipeline.state.stuck
    assert pipeline.last is not None
    assert pipeline.last.window >= 50
    true = next(t for t, _ in run(find("tunnel_entry"), 0.1, 1) if t.t_ns == pipeline.last.t_ns)
    assert pipeline.last.speed_mps == pytest.approx(true.speed_mps, abs=1.0)


@pytest.mark.parametrize("held_s", [0.2, 0.5, 1.0, 2.0])
@pytest.mark.parametrize("method", ["bank", "rail_condition"])
def test_a_position_that_is_held_until_the_next_one_is_measured_once(held_s: float, method: str) -> None:
    """A receiver that is slower than the messages: the train stays known as fast as it is, from the start on."""
    pipeline, newest = Pipeline(replace(FAST, method=method), 1), PositionSample(0, 0.0, 0.25)
    times, speeds = zip(*((r.t_ns, truth.speed_mps) for truth, r in run(find("tunnel_entry"), 0.1, 1)), strict=True)
    for sample in ride(0.0, 34.0):
        sent = sample
        if isinstance(sample, PositionSample):
            newest = sample if sample.t_ns >= newest.t_ns + held_s * S or not newest.t_ns else newest
            sent = sample._replace(position_m=newest.position_m)
        for estimate, *_ in pipeline.push(sent):
            off_mps = estimate.speed_mps - np.interp(estimate.t_ns, times, speeds)
            assert abs(off_mps) < 4.0 * estimate.speed_std_mps + 0.1, estimate
    assert pipeline.dropped["HELD"] > 100
    assert "OUTLIER" not in pipeline.dropped
    assert "RESET" not in pipeline.dropped


def test_a_train_that_stands_is_not_stuck() -> None:
    """Noise-free positions of a train that brakes at 1 m/s^2 from 20 m/s and stays at 200 m, then none for a while."""
    pipeline = Pipeline(FAST, 1)
    for tick in (*range(600), *range(1200, 1400)):
        t = tick / 10
        place = 20.0 * t - t**2 / 2 if t < 20.0 else 200.0
        pipeline.push(PressureSample(tick * S // 10, 2e5))
        pipeline.push(PositionSample(tick * S // 10, place, 0.25))
        assert not pipeline.state.stuck
    assert "STUCK" not in pipeline.dropped


def test_a_coarse_sensor_is_not_stuck() -> None:
    pipeline = Pipeline(FAST, 1)
    for sample in ride(10.0, 40.0, 50.0):
        coarse = sample._replace(position_m=round(sample.position_m)) if isinstance(sample, PositionSample) else sample
        pipeline.push(coarse)
        assert not pipeline.state.stuck


def test_least_way_is_that_of_the_strongest_braking() -> None:
    times = np.linspace(0.0, 4.0, 4001)
    speeds = np.maximum(9.0 - STRONGEST_MPS2 * times, 0.0)
    assert least_way(9.0, 4.0) == pytest.approx(trapezoid(speeds, times), abs=1e-3)


def test_a_flood_is_thinned_to_200_a_second_of_every_sensor() -> None:
    """But for the burst with which it begins."""
    pipeline = Pipeline(FAST, 1)
    for tick in range(10_000):  # a second at 10 kHz
        t_ns = tick * S // 10_000
        pipeline.push(PressureSample(t_ns, 0.0))
        pipeline.push(SpeedSample(t_ns, 80.0))
        pipeline.push(PositionSample(t_ns, 80.0 * tick / 10_000, 0.25))
    assert pipeline.accepted <= 211
    assert pipeline.dropped["TOO_OFTEN"] >= 3 * (10_000 - 211)
    assert pipeline.measurements == 10_000


@pytest.mark.parametrize("mps", [8.0, 50.0, 55.0])
def test_the_first_speed_in_kmh_is_refused_with_the_remedy(mps: float) -> None:
    pipeline = Pipeline(FAST, 1)
    for tick in range(100):
        pipeline.push(PressureSample(tick * S // 10, 0.0))
        pipeline.push(PositionSample(tick * S // 10, mps * tick / 10, 0.25))
    told = []
    for tick in range(100, 110):
        samples: list[Sample] = [PressureSample(tick * S // 10, 0.0)]
        if tick < 104:
            samples.append(SpeedSample(tick * S // 10, 3.6 * mps if tick == 103 else mps))
        for sample in (*samples, PositionSample(tick * S // 10, mps * tick / 10, 0.25)):
            pipeline.push(sample)
            told += [str(event) for event in pipeline.events]
    assert len(told) == 1
    assert "divide km/h by 3.6" in told[0]
    assert pipeline.dropped == {"SPEED_IN_KMH": 1}


def test_a_short_recording_in_a_loop_is_one_reset_each_and_goes_on_within_a_window() -> None:
    """20 s of it, again and again: less than reset_s, so that every message of the second turn would be late."""
    pipeline = Pipeline(FAST, 1)
    turn = ride(15.0, 35.0)
    for number in range(3):
        predictions = feed(pipeline, turn)
        assert pipeline.state.counts[Outcome.RESET] == number
        windows = [p.estimate.t_ns / S for p in predictions if p.estimate.window >= FAST.window]
        assert windows[-1] > 34.0
        coasting = next(p.estimate for p in predictions if p.estimate.t_ns < 30 * S)
        assert coasting.t_ns < 15.0 * S + 5.0 * S  # a window of 50 after the turn's begin


def test_messages_of_a_slow_second_source_are_late_and_no_reset() -> None:
    pipeline = Pipeline(FAST, 1)
    samples = ride(10.0, 30.0)
    for index in range(2, len(samples), 2):
        feed(pipeline, samples[index : index + 2])
        if index > 60:
            pipeline.push(samples[index - 59])  # 3 s old, as every time
    assert pipeline.state.counts[Outcome.LATE] > 50
    assert pipeline.state.counts[Outcome.RESET] == 0


def test_a_reset_forgets_all_but_the_counts() -> None:
    """What comes after it is what a new pipeline says of the same samples."""
    again, fresh = Pipeline(FAST, 1), Pipeline(FAST, 1)
    feed(again, ride(10.0, 25.0))
    again.reset()
    counted, windows = again.accepted, again.windows
    later = ride(22.0, 32.0)
    assert [p.estimate for p in feed(again, later)] == [p.estimate for p in feed(fresh, later)]
    assert (again.accepted - counted, again.windows - windows) == (fresh.accepted, fresh.windows)
    assert again.resets == 1


@pytest.mark.parametrize("variance_m2", [-0.25, 0.0, float("nan"), float("inf")])
def test_a_repeated_position_of_any_variance_is_judged_behind_the_guard(variance_m2: float) -> None:
    pipeline = Pipeline(FAST, 1)
    feed(pipeline, ride(10.0, 15.0))
    accepted = pipeline.accepted
    for tick in (1, 2):
        pipeline.push(PositionSample(15 * S + tick * S // 10, 1e3, variance_m2))
    pipeline.finish()
    assert pipeline.accepted <= accepted + 2
    assert pipeline.dropped == {"INVALID": 2}


def test_what_waits_behind_a_step_back_in_time_is_used_and_counted() -> None:
    """The pressure that the last positions wait for never comes, so the end of the data finds several of them."""
    pipeline = Pipeline(Config(max_outliers=1), 1)
    forth = [PositionSample(k * S // 10, 8.0 * k, 0.25) for k in range(3)]
    feed(pipeline, [*forth, PressureSample(0, 0.0), forth[0], PressureSample(S // 10, 0.0), forth[1]])
    pipeline.finish()
    assert pipeline.measurements == 5
    assert pipeline.accepted + sum(pipeline.dropped.values()) == 5
