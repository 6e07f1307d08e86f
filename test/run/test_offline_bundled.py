# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Telegrams that bundle seconds of all sensors, one topic behind the other, under one log time."""

from pathlib import Path

from test_offline import FAST_CONFIG, START_NS, encoded, samples, write_run

from adhesion_node.bag import BagReader, BagWriter
from adhesion_node.run.offline import messages, replay
from adhesion_node.run.pipeline import Pipeline
from adhesion_node.run.results.score import Truth
from adhesion_node.wire.line import NOMINAL

BUNDLE = 20


def digest(path: Path) -> str:
    pipeline = Pipeline(FAST_CONFIG, 1)
    with BagReader(path) as reader:
        names = {name: name.lstrip("/") for name in reader.topics}
        replay(pipeline, Truth(), messages(reader, names, NOMINAL), NOMINAL)
    return pipeline.digest


def test_bundled_messages_tell_what_they_tell_one_by_one(tmp_path: Path) -> None:
    """A node hears all topics in turn; offline seconds of positions came before their first pressure."""
    taken = samples()
    write_run(tmp_path / "each", taken)
    with BagWriter(tmp_path / "bundled") as writer:
        for begin in range(0, len(taken), BUNDLE):
            bundle = taken[begin : begin + BUNDLE]
            of_topics = zip(*(encoded(*sample) for sample in bundle), strict=True)
            for each in reversed(list(of_topics)):
                for topic, cdr in each:
                    writer.write(f"/{topic.name}", topic.type, cdr, START_NS + bundle[-1][0].t_ns)
    assert digest(tmp_path / "bundled") == digest(tmp_path / "each")
