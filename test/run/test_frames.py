# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""`adhesion_node.estimate`: frame in, frame out, the same numbers as a log's; every slip of the pen is named."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from conftest import ROOT
from test_offline import samples

import adhesion_node
from adhesion_node import Config, Curve, Grade, Measurement, Track, Train, Tunnel, estimate, finish, init, step
from adhesion_node.nodes import replay
from adhesion_node.run.results.rows import COLUMNS
from adhesion_node.tools import import_csv


@cache
def measured() -> pd.DataFrame:
    """Return 18 s of a train, a full brake from the fifth second on."""
    rows = [(t.t_ns / 1e9, r.position_m, max(round(r.pressure_pa - 101_325.0, 3), 0.0)) for t, r in samples()]
    return pd.DataFrame(rows, columns=["time", "position", "brake_pressure"])


def with_everything() -> pd.DataFrame:
    """Return the same with other sensors beside it, each with gaps."""
    frame = measured().assign(speed_std=20.0, acceleration=0.0, brake_demand=measured()["brake_pressure"])
    frame["speed"] = np.linspace(80.0, 75.0, len(frame))
    frame["wheel_speed_1"] = frame["wheel_speed_2"] = 80.0 / 0.46
    frame.loc[frame.index % 3 > 0, ["speed", "speed_std", "wheel_speed_2"]] = np.nan
    frame.loc[frame.index % 5 > 0, "position"] = np.nan
    return frame


@pytest.mark.parametrize("frame", [measured(), with_everything()], ids=["positions", "everything"])
def test_a_frame_gives_what_its_log_gives_to_the_bit(frame: pd.DataFrame, tmp_path: Path) -> None:
    log, bag, result = tmp_path / "log.csv", tmp_path / "run", tmp_path / "result.json"
    frame.to_csv(log, index=False)
    assert import_csv.main([str(log), "--output", str(bag)]) == 0
    assert replay.main([str(bag), "--offline", "--json", str(result)]) in (0, 1)  # 1: nothing was identified
    expected = json.loads(result.read_text(encoding="utf-8"))
    found = estimate(frame)
    assert found.attrs["digest"] == expected["digest"]
    assert {name: found.attrs[name] for name in ("measurements", "accepted", "dropped")} == {
        name: expected[name] for name in ("measurements", "accepted", "dropped")
    }
    assert found["mu"].iloc[-1] == expected["mu_final"]
    assert found.attrs["why"] == expected.get("why")


@pytest.mark.parametrize("unit_pa", [1e5, 1e3])
def test_a_pressure_in_another_unit_is_no_brake_that_is_known(unit_pa: float) -> None:
    frame = measured()
    found = estimate(frame.assign(brake_pressure=frame.brake_pressure / unit_pa))
    assert str(found.attrs["why"]).startswith(
        f"the brake pressure is {410e3 / unit_pa:.3g} Pa at most: is its unit right"
    )


def test_the_result_has_the_columns_of_a_file_and_the_time_of_the_frame() -> None:
    frame = measured()
    found = estimate(frame)
    assert list(found.columns) == ["time", *COLUMNS]
    assert set(found["time"]) <= set(frame["time"])
    assert (found["t_ns"] == (found["time"] * 1e9).round()).all()
    assert found["regime"].isin(["COASTING", "ADHESION_LIMITED", "BRAKE_LIMITED"]).all()
    assert found.dtypes["t_ns"] == np.int64
    assert (found.dtypes[["mu", "mu_lower", "safe_m"]] == np.float64).all()


@pytest.mark.parametrize("zone", [None, "Europe/Berlin"])
def test_datetimes_stay_datetimes(zone: str | None) -> None:
    frame = measured()
    times = pd.Timestamp("2024-11-21 08:15", tz=zone) + pd.to_timedelta(frame["time"], unit="s")
    found = estimate(frame.assign(time=times))
    assert found["time"].isin(times).all()
    assert np.allclose(found["mu"], estimate(frame)["mu"])


def test_a_method_of_windows_and_another_train_are_a_config_away() -> None:
    config = Config(method="rail_condition", train=Train(mass_kg=400e3), track=Track((Grade(0.0, 1e4, 20.0),)))
    found = estimate(measured(), config, seed=3)
    assert found["brake_factor"].isna().all()
    assert (found["mu"] > 0.0).all()


def test_the_stepwise_surface_gives_the_same() -> None:
    config, found = Config(), estimate(measured())
    state, estimates = init(config, 1), []
    for time, position_m, pressure_pa in measured().itertuples(index=False):
        measurement = Measurement(round(time * 1e9), position_m, 0.25, pressure_pa)
        state, made = step(config, state, measurement)
        estimates += [] if made is None else [made]
    estimates += finish(config, state)[1]
    assert [each.mu for each in estimates] == pytest.approx(found["mu"].tolist())


def test_numbers_of_numpy_are_numbers() -> None:
    config = Config(window=int(np.int64(40)), start_mu=slip(np.float32(0.125)), train=Train(mass_kg=np.float64(4e5)))
    assert Config(window=slip(np.int64(40)), start_mu=0.125, train=Train(mass_kg=4e5)) == config


def slip(value: Any) -> Any:
    """Return a value of which the type checker knows nothing."""
    return value


def slipped(**changes: Any) -> pd.DataFrame:
    return measured().assign(**changes)


@pytest.mark.parametrize(
    ("frame", "message"),
    [
        ([1, 2], "frame = list: give a pandas DataFrame"),
        (measured().rename(columns={"brake_pressure": "pressure"}), "column 'pressure': did you mean 'brake_pressure'"),
        (slipped(notes="wet"), "column 'notes': rename it to one of time, position, .*, or drop it"),
        (measured().drop(columns="time"), r"has the columns \['position', 'brake_pressure'\]: give 'time' and"),
        (measured().set_index("time"), r"or 'speed'; frame.reset_index\(names='time'\) makes a column of its index"),
        (measured().drop(columns="position"), "give 'time' and 'position' or 'speed'"),
        (slipped(brake_pressure="4,1"), "column 'brake_pressure': .*: give numbers, NaN where nothing was measured"),
        (slipped(time="08:15:03"), "column 'time' is of .*: give seconds, or datetimes by pandas.to_datetime"),
        (measured().iloc[::-1], r"column 'time', row 1: 32\.8 falls: frame.sort_values\('time'\) mends it"),
        (measured().replace({"time": {15.3: np.nan}}), "column 'time', row 3: no time: drop the row"),
        (slipped(position=1e9), "nothing to estimate from in 180 rows; dropped: {'INVALID': 180}"),
        (slipped(time=1e3 * measured()["time"]), "dropped: nothing; a row every 100 s: are the times in ms\\? give s"),
        (slipped(position=True), "column 'position' is of bool: give numbers, NaN where nothing was measured"),
        (slipped(position=1j), "column 'position' is of complex128: give numbers"),
        (slipped(speed=pd.Timestamp("2024")), "column 'speed' is of datetime64.*: give numbers"),
        (pd.concat([measured(), measured()[["position"]]], axis=1), "column 'position': is there twice: drop one"),
        (slipped(speed_std=-0.1), "column 'speed_std', row 0: -0.1: give it above 0, NaN where it is unknown"),
        (slipped(variance=0.0), "column 'variance', row 0: 0: give it above 0, NaN where it is unknown"),
        (
            slipped(time=1.7e18 + measured()["time"] * 1e9),
            r"column 'time', row 0: 1.7e\+18 s: is it in ms, us or ns\? give seconds, or datetimes",
        ),
    ],
)
def test_a_frame_that_cannot_be_right_is_refused_with_the_remedy(frame: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        estimate(frame)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: estimate(measured(), slip({"start_mu": 0.1})), "config = {'start_mu': 0.1}: give a Config"),
        (lambda: estimate(measured(), seed=-1), "seed = -1: give an integer of at least 0"),
        (lambda: estimate(measured(), seed=slip("1")), "seed = '1': give an integer of at least 0"),
        (lambda: estimate(measured(), seed=slip(1.5)), "seed = 1.5: give an integer of at least 0"),
        (lambda: estimate(measured(), std_m=0.0), r"std_m = 0\.0: give the positions' standard deviation"),
        (lambda: Config(train=slip("CRH3")), "train = 'CRH3': give a Train"),
        (lambda: Config(track=slip("grade 0 1 2")), "track = 'grade 0 1 2': give a Track"),
        (lambda: Train(mass_kg=slip("536 t")), "train.mass_kg = '536 t': give a value of type float"),
        (lambda: Track((Tunnel(0.0, 1e3), Curve(0.0, 1e3, 2.0, 1.0))), "radius_m of at least 10 m"),
    ],
)
def test_what_is_no_setting_is_refused_by_name_value_and_remedy(make: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        make()


def test_positions_that_fall_along_the_run_are_warned_of() -> None:
    frame = measured()
    with pytest.warns(UserWarning, match="positions fall while the train runs: change their sign, and turn the track"):
        estimate(frame.assign(position=-frame["position"]))


def test_drops_that_matter_are_warned_of() -> None:
    frame = slipped(position=measured()["position"].where(measured().index % 2 == 0, 5e7))
    with pytest.warns(UserWarning, match="90 of 180 positions were used, dropped: {'INVALID': 90}: are units"):
        estimate(frame)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"speed": lambda f: 3.6 * 80.0}, r"dropped of 180 rows: {'INVALID': 180}: are units, signs and standard"),
        (
            {"position": lambda f: np.nan, "speed": lambda f: 140.0 - f["time"]},
            "1.* m/s, 4.* km/h: is its speed in km/h",
        ),
    ],
)
def test_units_that_cannot_be_are_warned_of(changes: dict[str, Any], message: str) -> None:
    with pytest.warns(UserWarning, match=message):
        estimate(measured().assign(**changes))


@pytest.mark.parametrize("name", ["brake_pressure", "brake_demand", "wheel_speed_1"])
def test_a_zero_that_stands_for_no_value_is_warned_of(name: str) -> None:
    frame = with_everything()
    gaps = (frame.index % 10 == 7) & (frame["time"] - frame["time"].iloc[0] > 10.0)
    match = f"frame column '{name}' is 0 in {gaps.sum()} rows between others of the same value: no value. Make them NaN"
    with pytest.warns(UserWarning, match=match):
        estimate(frame.assign(**{name: frame[name].mask(gaps, 0.0)}))


@pytest.mark.parametrize("name", ["brake_pressure", "brake_demand"])
def test_an_absolute_pressure_is_warned_of(name: str) -> None:
    """The brake was taken to be applied for ever: a coasting train was told as ADHESION_LIMITED at a mu near 0."""
    frame = with_everything()
    frame[name] += 101_325.0
    frame.loc[3, name] = np.nan
    with pytest.warns(UserWarning, match=f"{name} never falls below 101325 Pa: is it absolute. Take the pressure of"):
        estimate(frame)


@pytest.mark.parametrize(("signs", "told"), [((1, -1), "axle 2"), ((-1, -1), "axle 1, axle 2")])
def test_wheels_that_turn_backwards_are_warned_of(signs: tuple[int, int], told: str) -> None:
    """They seemed to slide: on a dry rail mu was told as what a weak brake gives."""
    frame = with_everything()
    wheels = {f"wheel_speed_{axle}": sign * frame[f"wheel_speed_{axle}"] for axle, sign in enumerate(signs, 1)}
    with pytest.warns(UserWarning, match=f"^{told}: turned backwards while the train runs: change the sign, wheels"):
        estimate(frame.assign(**wheels))


def test_positions_too_coarse_for_their_deviation_are_warned_of() -> None:
    frame = measured()
    coarse = frame.assign(position=75.0 * (frame["position"] / 75.0).round())
    with pytest.warns(UserWarning, match="positions come in steps of 75 m, std_m = 0.5: give 21.7 or more"):
        estimate(coarse)


def test_a_brake_that_gives_more_than_it_is_told_to_is_warned_of() -> None:
    """A train of three times its mass: `replay --offline` told it."""
    told = r"the train slows by 0\.7\d m/s\^2, its full brake gives 0\.3\d: check the units .*Config.train"
    with pytest.warns(UserWarning, match=told):
        estimate(measured(), Config(train=Train(mass_kg=1608e3)))


def test_a_track_elsewhere_is_warned_of() -> None:
    elsewhere = Config(track=Track((Grade(1e5, 1.2e5, 10.0),)))
    with pytest.warns(UserWarning, match="no section of the track is where the train ran: the nearest is 9.* m ahead"):
        estimate(measured(), elsewhere)


def test_every_public_name_is_there_and_documented() -> None:
    page = (ROOT / "doc" / "python.md").read_text(encoding="utf-8")
    for name in adhesion_node.__all__:
        assert getattr(adhesion_node, name).__doc__, name
        assert f"`{name}" in page, name
    assert sorted(adhesion_node.__all__) == dir(adhesion_node)
    with pytest.raises(AttributeError, match="no attribute 'guess'"):
        getattr(adhesion_node, slip("guess"))
