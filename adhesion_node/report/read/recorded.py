# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The run of a recording that holds the results of the estimator, as recorded."""

from collections.abc import Mapping, Sequence
from operator import attrgetter

import numpy as np

from ...bag import BagReader
from ...core.physics.train import GRAVITY
from ...wire import topics
from ...wire.line import NOMINAL, Line
from ...wire.messages.results import Status
from ..ahead import TOLD
from .gathered import Keyed, Logged, Numbers, Texts
from .inputs import Inputs
from .messages import Sample, Take, read_topics, with_key
from .predicted import Curves
from .run import Run

RESULTS = (topics.MU, topics.MU_LOWER, topics.STATE)
"""Without these a recording holds no results."""


def read_run(reader: BagReader, line: Line = NOMINAL, keys: Sequence[str] = (), targets: Sequence[float] = ()) -> Run:
    """Read the series in one pass, and what is told of estimates by `keys`, with the standard deviations of the state.

    The braking distances to `targets`, m/s, are those of every curve. Raises ValueError when the recording holds no
    estimates.
    """
    position, speed = Numbers(attrgetter("position_m")), Logged(attrgetter("speed_mps"))
    # mu stands in its stamped form, the deceleration -mu g, where that was recorded.
    stamped = Logged(lambda read: -read.acceleration_mps2 / GRAVITY)
    mu, mu_lower, told, inputs, levels = Logged(), Logged(), _Told(), Inputs(), Texts()
    position_std, speed_std = Numbers(attrgetter("position_std_m")), Numbers(attrgetter("speed_std_mps"))
    values, said = Keyed(keys), Keyed(TOLD)
    takes = told.take, with_key("regime", told.note), with_key("regime", values.note)
    curves = {topic: Curves(targets) for topic in (topics.BRAKING_CURVE, topics.BRAKING_CURVE_NOMINAL)}
    read_topics(
        reader,
        [
            *inputs.takes,
            *((topic, _curve_taker(each)) for topic, each in curves.items()),
            (topics.MU, mu.take),
            (topics.MU_LOWER, mu_lower.take),
            (topics.STATE, position.take),
            (topics.STATE, speed.take),
            *((topics.STATE, each.take) for each in (position_std, speed_std) if keys),
            (topics.DECELERATION, stamped.take),
            *((topics.DIAGNOSTICS, _of_train(reader.namespace, take)) for take in takes),
            (topics.ATP_STATUS, with_key("level", said.note)),
            (topics.ATP_STATUS, with_key("level", lambda t_ns, status: levels.add(t_ns, status.values["level"]))),
        ],
        line,
    )
    deceleration = stamped.series
    run = inputs.run._replace(
        creep=inputs.creep.curves(reader.namespace.strip("/")),
        mu=deceleration if deceleration.t_ns.size else mu.stamped_by(speed),
        mu_lower=mu_lower.stamped_by(speed, stamped),
        position=position.series.known,
        speed=speed.series.known,
        regime=told.regime.series,
        safe=curves[topics.BRAKING_CURVE],
        nominal=curves[topics.BRAKING_CURVE_NOMINAL],
        remarks=told.remarks.series,
        levels=levels.series,
        changes=told.changes.series,
        said=said.series,
        counts=told.counts,
        told={**values.series, "position_std_m": position_std.series, "speed_std_mps": speed_std.series},
    )
    for topic, series in zip(RESULTS, (run.mu, run.mu_lower, run.speed), strict=True):
        if not series.t_ns.size:
            raise ValueError(f"bag = {reader.path}: holds no {topic.name}: record while the estimator runs")
    return run


class _Told:
    """What the diagnostics of the estimator tell, while read."""

    def __init__(self) -> None:
        self.regime, self.remarks, self.changes = Texts(), Texts(), Texts()
        self.counts: Mapping[str, str] = {}

    def take(self, sample: Sample) -> None:
        """Take the last values, of no estimate too."""
        self.counts = next((each.values for each in sample.read.entries if "regime" in each.values), self.counts)

    def note(self, t_ns: int, status: Status) -> None:
        """Take what is told of an estimate."""
        self.regime.add(t_ns, status.values["regime"])
        self.remarks.add(t_ns, status.message if status.level else "")
        if "changes" in status.values:
            self.changes.add(t_ns, status.values["changes"])


def _of_train(namespace: str, take: Take) -> Take:
    """Leave out what the nodes of others tell: its own have the namespace of the topics that are read."""

    def taken(sample: Sample) -> None:
        own = tuple(entry for entry in sample.read.entries if entry.namespace == namespace.strip("/"))
        take(sample._replace(read=sample.read._replace(entries=own)))

    return taken


def _curve_taker(curves: Curves) -> Take:
    def take(sample: Sample) -> None:
        if sample.read is not None:
            t_ns, places = np.atleast_1d(sample.read.t_ns), np.atleast_2d(sample.read.places_m)
            curves.add(t_ns, places, np.atleast_2d(sample.read.curve.speed_mps))

    return take
