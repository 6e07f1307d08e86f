# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""From a pandas frame of what was measured to a frame of what is estimated, as an imported log and its replay do."""

import math
import warnings
from collections.abc import Iterable, Iterator
from difflib import get_close_matches
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ..core import (
    Config,
    DemandSample,
    ImuSample,
    PositionSample,
    Prediction,
    PressureSample,
    Sample,
    SpeedSample,
    WheelSample,
)
from ..core.physics.train import Array
from .pipeline import BACK_M, Pipeline
from .results.brake import odd_brake
from .results.doubts import AXLE, doubts
from .results.rows import COLUMNS, Row, row_of
from .results.seen import Seen

MEASURED = ("position", "variance", "speed", "speed_std", "brake_pressure", "brake_demand", "acceleration")
"""Columns beside `time` and those of the axles; m, m^2, m/s, Pa above the atmosphere, m/s^2."""

NO_NUMBERS = (
    pd.api.types.is_bool_dtype,
    pd.api.types.is_complex_dtype,
    pd.api.types.is_datetime64_any_dtype,
    pd.api.types.is_timedelta64_dtype,
)
"""Kinds of columns that pandas takes for numbers, too."""

MAX_SECONDS = 2.0**31
"""Later than 2038 is no time in seconds; a message has room for no more."""

FAR_S = 10.0
"""Between two rows of a recorder."""

MOSTLY_USED = 0.9
"""Share of the measurements below which it is worth a warning that so few were used."""


def estimate(frame: pd.DataFrame, config: Config | None = None, *, seed: int = 1, std_m: float = 0.5) -> pd.DataFrame:
    """Identify the adhesion from what was measured; one row per estimate.

    `frame` has one row per time: `time`, in s or as datetimes (those without zone are UTC), and what was measured then,
    by the names of `MEASURED` and `wheel_speed_1`, `wheel_speed_2` ... (rad/s); NaN is what was not measured. `std_m`
    is the standard deviation of positions without a `variance`.

    The result has `time` as the frame has it, and the columns of `replay --offline --out`; its `attrs` hold
    `measurements`, `accepted`, `dropped` by reason, the `digest`, and `why` nothing is identified, or None. Raises
    ValueError naming what is wrong with the frame, the configuration or the seed, and what to do. Warns where many of
    the measurements were not used, where the positions fall along the run, where an axle turns backwards, where a 0
    seems to stand for no value, where a pressure is absolute, or the brake gives more or less than it is told to.
    """
    config = Config() if config is None else config
    if not isinstance(config, Config):
        raise ValueError(f"config = {config!r}: give a Config, such as Config(train=Train(mass_kg=400e3))")
    if not (isinstance(std_m, int | float) and 0.0 < std_m < math.inf):
        raise ValueError(f"std_m = {std_m!r}: give the positions' standard deviation, above 0 m")
    columns, t_ns = _checked(frame), _nanoseconds(frame["time"])
    far = _too_far(t_ns)
    pipeline, rows, seen = Pipeline(config, seed), list[Row](), Seen(config.train.full_pressure_pa)
    for made in _predictions(pipeline, _samples(t_ns, columns, std_m)):
        e = made.estimate
        seen.follow(pipeline, e)
        rows.append(row_of(pipeline, made))
    used = {name: getattr(pipeline, name) for name in ("measurements", "accepted", "dropped", "digest")}
    if not rows:
        raise ValueError(
            f"frame: nothing to estimate from in {len(frame)} rows; dropped: {pipeline.dropped or 'nothing'}"
            + (f"; {far}" if far else "")
        )
    if pipeline.accepted < MOSTLY_USED * pipeline.measurements:
        text = f"{pipeline.accepted} of {pipeline.measurements} positions were used, dropped: {pipeline.dropped}"
        warnings.warn(f"{text}: are units, signs and standard deviations right?", stacklevel=2)
    elif max(pipeline.dropped.values(), default=0) > (1.0 - MOSTLY_USED) * len(frame):
        text = f"dropped of {len(frame)} rows: {pipeline.dropped}"
        warnings.warn(f"{text}: are units, signs and standard deviations right?", stacklevel=2)
    if pipeline.back_m > BACK_M:
        text = "positions fall while the train runs: change their sign, and turn the track"
        warnings.warn(f"{text}, so that they grow in the direction of travel", stacklevel=2)
    brake = (odd_brake(seen, pipeline) or "").replace("--train", "Config.train") or None
    for odd in (far, *doubts(t_ns, columns, std_m), pipeline.off_track, pipeline.turned, seen.too_fast, brake):
        if odd is not None:
            warnings.warn(odd, stacklevel=2)
    result = pd.DataFrame(rows, columns=list(COLUMNS)).astype(dict(COLUMNS))
    result.insert(0, "time", _like(result["t_ns"].to_numpy(), frame["time"]))
    result.attrs.update(used, why=seen.why_not(brake))
    return result


def _predictions(pipeline: Pipeline, samples: Iterable[Sample]) -> Iterator[Prediction]:
    for sample in samples:
        yield from pipeline.push(sample)
    yield from pipeline.finish()


def _checked(frame: pd.DataFrame) -> dict[str, Array]:
    """The measured columns as numbers. Raises ValueError for what is no frame or has a column that means nothing."""
    if not isinstance(frame, pd.DataFrame):
        raise ValueError(f"frame = {type(frame).__name__}: give a pandas DataFrame, pandas.DataFrame(...) makes one")
    known = ("time", *MEASURED)
    for name in frame.columns:
        if name not in known and not AXLE.fullmatch(str(name)):
            close = get_close_matches(str(name), known, n=1, cutoff=0.5)
            hint = f"did you mean {close[0]!r}? " if close else ""
            raise ValueError(
                f"frame column {name!r}: {hint}rename it to one of {', '.join(known)}, wheel_speed_1 ..., or drop it"
            )
    if "time" not in frame or not {"position", "speed"} & set(frame.columns):
        is_index = frame.index.name == "time" or isinstance(frame.index, pd.DatetimeIndex)
        hint = "; frame.reset_index(names='time') makes a column of its index" if is_index else ""
        raise ValueError(f"frame has the columns {list(frame.columns)}: give 'time' and 'position' or 'speed'{hint}")
    for name in frame.columns[frame.columns.duplicated()]:
        raise ValueError(f"frame column {name!r}: is there twice: drop one")
    columns = {}
    for name in frame.columns.drop("time"):
        if any(is_kind(frame[name]) for is_kind in NO_NUMBERS):
            raise ValueError(
                f"frame column {name!r} is of {frame[name].dtype}: give numbers, NaN where nothing was measured"
            )
        try:
            columns[str(name)] = pd.to_numeric(frame[name]).to_numpy(np.float64, na_value=math.nan)
        except (ValueError, TypeError) as error:
            raise ValueError(f"frame column {name!r}: {error}: give numbers, NaN where nothing was measured") from error
    for name in {"variance", "speed_std"} & columns.keys():
        if (wrong := columns[name] <= 0.0).any():
            row = int(np.argmax(wrong))
            raise ValueError(
                f"frame column {name!r}, row {row}: {columns[name][row]:g}: give it above 0, NaN where it is unknown"
            )
    return columns


def _too_far(t_ns: NDArray[np.int64]) -> str | None:
    """Say that no recorder has rows so far apart."""
    step_s = float(np.median(np.diff(t_ns))) * 1e-9 if t_ns.size > 2 else 0.0
    return f"a row every {step_s:.3g} s: are the times in ms? give seconds" if step_s > FAR_S else None


def _nanoseconds(time: "pd.Series[Any]") -> NDArray[np.int64]:
    """Stamps, ns, that rise. Raises ValueError where they do not, or are no times."""
    if pd.api.types.is_datetime64_any_dtype(time):
        naive = time.dt.tz_convert(None) if time.dt.tz is not None else time
        missing, stamps = time.isna().to_numpy(), naive.to_numpy("datetime64[ns]").astype(np.int64)
    elif pd.api.types.is_numeric_dtype(time):
        seconds = time.to_numpy(np.float64, na_value=math.nan)
        missing = ~np.isfinite(seconds)
        beyond = np.abs(np.where(missing, 0.0, seconds)) > MAX_SECONDS
        if beyond.any():
            row = int(np.argmax(beyond))
            where = f"frame column 'time', row {row}: {seconds[row]:.3g} s"
            raise ValueError(f"{where}: is it in ms, us or ns? give seconds, or datetimes by pandas.to_datetime")
        stamps = np.rint(np.where(missing, 0.0, seconds) * 1e9).astype(np.int64)
    else:
        raise ValueError(f"frame column 'time' is of {time.dtype}: give seconds, or datetimes by pandas.to_datetime")
    if missing.any():
        raise ValueError(f"frame column 'time', row {int(np.argmax(missing))}: no time: drop the row")
    falls = np.diff(stamps) < 0
    if falls.any():
        row = int(np.argmax(falls)) + 1
        raise ValueError(f"frame column 'time', row {row}: {time.iloc[row]} falls: frame.sort_values('time') mends it")
    checked: NDArray[np.int64] = stamps
    return checked


def _like(t_ns: NDArray[np.int64], time: "pd.Series[Any]") -> Any:
    """Stamps as the frame has them."""
    if not pd.api.types.is_datetime64_any_dtype(time):
        return t_ns / 1e9  # the float nearest to the decimal, as the frame may have it
    utc = pd.DatetimeIndex(t_ns.astype("datetime64[ns]"), tz="UTC")
    return utc.tz_convert(time.dt.tz)


def _samples(t_ns: NDArray[np.int64], columns: dict[str, Array], std_m: float) -> Iterator[Sample]:
    """The samples of every row, the position last, as in a recording."""
    nothing = np.full(t_ns.size, math.nan)
    given = [columns.get(name, nothing).tolist() for name in MEASURED]
    axles = sorted((name for name in columns if AXLE.fullmatch(name)), key=lambda name: int(name.rpartition("_")[2]))
    wheels = np.array([columns[name] for name in axles]).T.tolist() if axles else [()] * t_ns.size
    for t, position, variance, speed, speed_std, pressure, demand, felt, turning in zip(
        t_ns.tolist(), *given, wheels, strict=True
    ):
        if not math.isnan(pressure):
            yield PressureSample(t, max(pressure, 0.0))  # a cylinder only pushes
        if not math.isnan(demand):
            yield DemandSample(t, max(demand, 0.0))
        if not math.isnan(speed):
            yield SpeedSample(t, speed, None if math.isnan(speed_std) else speed_std**2)
        if not math.isnan(felt):
            yield ImuSample(t, felt)
        if not all(map(math.isnan, turning)):
            yield WheelSample(t, tuple(turning))
        if not math.isnan(position):
            yield PositionSample(t, position, std_m**2 if math.isnan(variance) else variance)
