# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What a person is told of a log: why rows are refused, how it was read, and from where to where its columns go."""

import sys
from collections import Counter
from collections.abc import Iterator

import numpy as np

from ...core.physics.train import KMH
from .format import FAMILIES, LIMITS, PRESSURES, Format, option
from .text import Refusal
from .whole.clock import moment
from .whole.read import Log

SHOWN = 5
"""Lines for each reason why rows are refused."""


class Refused:
    """Counts the refused rows, and says the first `SHOWN` of each reason on standard error."""

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()

    def tell(self, refusal: Refusal) -> None:
        self.counts[refusal.reason] += 1
        if self.counts[refusal.reason] <= SHOWN:
            print(f"import_csv: {refusal.message}", file=sys.stderr)

    def end(self) -> None:
        for reason, count in sorted(self.counts.items()):
            if count > SHOWN:
                print(f"import_csv: {count - SHOWN} more: {reason}", file=sys.stderr)


def read_as(form: Format) -> str:
    """Say how a log was understood, and what says otherwise."""
    header = (form.skip_rows or 0) + 1
    text = f"{form.encoding}, delimiter {form.delimiter!r}, decimal {form.decimal!r}, header in line {header}"
    if form.below > 1:
        text += f", lines {header + 1} to {header + form.below} left out, units in line {header + form.units_at}"
    elif form.below:
        text += f", line {header + 1} left out as units"
    time = (
        f"times in {form.time_unit}" if form.time_format is None else f"times {form.time_format!r} of {form.time_zone}"
    )
    otherwise = (
        "--encoding, --delimiter, --decimal, --skip-rows, --time-unit, --time-format and --time-zone say otherwise"
    )
    return f"read as {time}" if form.encoding is None else f"read as {text}, {time}; {otherwise}"


def units_read(form: Format) -> Iterator[str]:
    """Say which units the log itself names, and what says otherwise."""
    told = {ours: unit for ours, unit in form.told.items() if form.given(ours) in (None, unit)}
    options = dict.fromkeys(f"--{FAMILIES[ours]}-unit" for ours in told if ours in FAMILIES)
    if told:
        absolute = form.absolute if form.is_gauge is None else ()
        units = ", ".join(f"{ours} in {unit}{' absolute' * (ours in absolute)}" for ours, unit in told.items())
        yield f"units that the log names: {units}" + (f"; otherwise: {', '.join(options)}" if options else "")


def ranges(log: Log) -> Iterator[str]:
    """Say from where to where the columns go, so that a wrong unit shows."""
    t_ns = log.rows["t_ns"].to_numpy()
    first, length_s = t_ns[0], (t_ns[-1] - t_ns[0]) / 1e9
    step_s = float(np.median(np.diff(t_ns))) / 1e9 if len(t_ns) > 1 else 0.0
    yield f"{'time':<16} from {moment(first)} for {length_s:.9g} s, a row every {step_s:.3g} s"
    for name in log.rows.columns.drop("t_ns"):
        least, most = log.rows[name].min(), log.rows[name].max()
        if log.rows[name].isna().all():
            continue
        if name in PRESSURES:
            least, most = ((value - log.form.ambient_pressure_pa) / 1e5 for value in (least, most))
            yield f"{name:<16} {least:.3g} to {most:.3g} bar above the air"
        elif name == "speed":
            yield f"{name:<16} {least / KMH:.4g} to {most / KMH:.4g} km/h"
        else:
            yield f"{name:<16} {least:.9g} to {most:.9g} {LIMITS.get(name, LIMITS['wheel_speed'])[2].split(':')[0]}"
    if log.columns.unread:
        yield f"not read: {', '.join(log.columns.unread)}"
    if not any(name in log.columns.names for name in PRESSURES):
        options = [f"{option(name)} COL" for name in PRESSURES]
        yield f"no brake pressure: without one mu is not told; {', '.join(options[:-1])} or {options[-1]} names it"
