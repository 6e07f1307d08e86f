# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The run of a recording that holds sensor messages alone: what the estimator makes of them, offline."""

import sys
from array import array
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np

from ...bag import BagReader
from ...command.options import progress
from ...core import Estimate, Prediction
from ...core.intake.samples import DemandSample, PressureSample
from ...run import offline
from ...run.offline import Recorded
from ...run.pipeline import Pipeline
from ...run.results.brake import odd_brake
from ...run.results.rows import Write, row_of
from ...run.results.seen import Seen
from ...wire.line import Line
from ...wire.messages.refused import Rejected
from ...wire.settings.setup import Setup
from ...wire.topic import Frame
from ...wire.topics import ADHESION_INPUTS, DIAGNOSTICS, TRUTH
from .inputs import Inputs
from .messages import read_topics, sample_of
from .numbers import listed
from .predicted import Curves
from .run import Run
from .series import Series


def estimate_run(
    reader: BagReader, selection: Mapping[str, str], setup: Setup, write: Write, targets: Sequence[float] = ()
) -> tuple[Run, Mapping[str, int], tuple[str, ...]]:
    """Run the recorded topics of `selection` (recorded name to ours) through the estimator; write each estimate.

    Return the run, whose braking distances to `targets`, m/s, are those of every curve, and by recorded topic how many
    messages do not decode, and what `replay --offline` remarks. Raises ValueError when nothing could be estimated.
    """
    pipeline, inputs, lost = Pipeline(setup.config, setup.seed), Inputs(), Counter[str]()
    estimates, safe, nominal = _Estimates(), Curves(targets), Curves(targets)
    seen = Seen(setup.config.train.full_pressure_pa)
    recorded = progress(offline.messages(reader, selection, setup.line), "messages")
    for made in _predictions(pipeline, inputs, _noting(inputs, lost, recorded, setup.line), setup.line):
        write(row_of(pipeline, made, setup.line.sign))
        estimates.note(e := made.estimate)
        seen.follow(pipeline, e)
        for curves, curve in ((safe, made.safe), (nominal, made.nominal)):
            if curve is not None:
                places = made.estimate.position_m + curve.distance_m
                curves.add(np.array([made.estimate.t_ns]), places[np.newaxis], curve.speed_mps[np.newaxis])
    if pipeline.last is None:
        dropped = listed(pipeline.dropped) or "nothing, it is too short"
        why = "".join(f"; {remark}" for remark in offline.remarks(pipeline))
        raise ValueError(
            f"bag = {reader.path}: nothing to estimate from; dropped of its sensor messages: {dropped}{why}"
        )
    read_topics(reader, [(DIAGNOSTICS, inputs.creep.take)])
    namespaces = (theirs.strip("/").removesuffix(ours).strip("/") for theirs, ours in selection.items())
    run = estimates.put_into(inputs.run)._replace(
        creep=inputs.creep.curves(next(namespaces)),
        safe=safe,
        nominal=nominal,
        counts={  # under the keys that they have in the diagnostics
            "measurements": str(pipeline.measurements),
            "accepted": str(pipeline.accepted),
            "windows": str(pipeline.windows),
            **{f"dropped.{reason}": str(count) for reason, count in pipeline.dropped.items()},
            "confidence": f"{pipeline.config.confidence:g}",
            "digest": pipeline.digest,
        },
    )
    remarks = tuple(offline.remarks(pipeline, brake=odd_brake(seen, pipeline)))
    return run, {theirs: lost[ours] for theirs, ours in selection.items() if ours in lost}, remarks


class _Estimates:
    """The numbers and texts of estimates, while they are made; their series have one array of times."""

    def __init__(self) -> None:
        self._t_ns = array("q")
        self._numbers = {name: array("d") for name in ("mu", "mu_lower", "position", "speed")}
        self._texts = {name: list[str]() for name in ("regime", "changes")}

    def note(self, e: Estimate) -> None:
        """Take an estimate."""
        self._t_ns.append(e.t_ns)
        for numbers, value in zip(self._numbers.values(), (e.mu, e.mu_lower, e.position_m, e.speed_mps), strict=True):
            numbers.append(value)
        for texts, text in zip(self._texts.values(), (e.regime.name, str(e.changes)), strict=True):
            texts.append(sys.intern(text))

    def put_into(self, run: Run) -> Run:
        """Return the run with their series."""
        stamps = np.frombuffer(self._t_ns, dtype=np.int64)
        order = np.argsort(stamps, kind="stable")
        t_ns = stamps[order]
        numbers = {name: Series(t_ns, np.frombuffer(column)[order]) for name, column in self._numbers.items()}
        texts = {name: Series(t_ns, np.array(column, object)[order]) for name, column in self._texts.items()}
        return Run(**{**run._asdict(), **numbers, **texts})


def _predictions(pipeline: Pipeline, inputs: Inputs, recorded: Iterable[Recorded], line: Line) -> Iterator[Prediction]:
    """Yield what the messages give as soon as it is there, and note the pressures that were used."""
    for sample, made, _ in offline.feed(pipeline, recorded, ADHESION_INPUTS, line):
        if isinstance(sample, PressureSample):
            inputs.pressure.add(sample.t_ns, sample.pressure_pa)
        elif isinstance(sample, DemandSample):
            inputs.demand.add(sample.t_ns, sample.pressure_pa)
        yield from made
    yield from pipeline.finish()


def _noting(inputs: Inputs, lost: Counter[str], recorded: Iterable[Recorded], line: Line) -> Iterator[Recorded]:
    """Pass the messages on; note the truth, and what does not decode."""
    truth = {topic.name: topic._replace(frame=Frame.ANY) for topic in TRUTH}
    for name, message, log_ns in recorded:
        if isinstance(message, Rejected):
            lost[name] += 1
        elif name in truth:
            sample = sample_of(truth[name], message, log_ns, line)
            for take in (take for topic, take in inputs.truth if topic.name == name):
                take(sample)
        yield name, message, log_ns
