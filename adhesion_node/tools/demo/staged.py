# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What the nodes of a demo are to do, and the files that tell the estimator's part of it to any other estimator."""

from pathlib import Path

from sim_node.real import known
from sim_node.real.plant.scenarios import SCENARIOS as REAL
from sim_node.real.sensors import centre_line
from sim_node.real.sensors.fitted import FITTED
from sim_node.train.scenario import SCENARIOS

from ...command.written import write_text
from ...core.physics.track import Grade
from ...core.physics.train import KMH
from ...wire.files.parameters import text_of
from .line import Task

PARAMS, TRACK_LINE = "params.yaml", "track.geojson"
"""Files beside the recording: the estimator's parameters, and the centre line of a track that satellites need."""

TARGET_MPS2 = 0.18
"""A real train's target to stop at: as far as this deceleration takes, or half of what its full brake should give."""

TARGET_M, STOP_M = 14500.0, 16000.0
"""The target, for a speed or a stop: as near as brakes that come after 20 s at 300 km/h allow on an unknown rail."""

NEARER_M = {"approach": 6300.0}
"""Targets of scenarios that brake too late on purpose."""

LEVEL = "grade -100000 100000 0"
"""What a paper's line is told to be; of its tunnels, and of a grade where it has one, nothing is."""


def task_of(scenario: str, sensors: str, seed: int, folder: Path) -> Task:
    """What the nodes are to do; the files are written into the folder."""
    task = _real(scenario, sensors, seed, folder) if scenario in REAL else _of_paper(scenario, seed)
    write_text(folder / PARAMS, text_of("estimator", {**task.estimator, "seed": seed}))
    return task


def _of_paper(scenario: str, seed: int) -> Task:
    target_mps, track = SCENARIOS[scenario].end_speed_mps or 0.0, SCENARIOS[scenario].track
    target_m = NEARER_M.get(scenario, TARGET_M if target_mps else STOP_M)
    told = {} if any(isinstance(one, Grade) for one in track.sections) else {"track": LEVEL}
    monitor = {"target_position_m": target_m, "target_speed_kmh": target_mps / KMH}
    return Task(seed, {"scenario": scenario}, monitor, told)


def _real(scenario: str, sensors: str, seed: int, folder: Path) -> Task:
    """A real train stops. Where it is fitted with `fix`, the line of its track is written."""
    real = REAL[scenario]
    stopping_m = real.speed_mps**2 / 2 / min(TARGET_MPS2, real.nominal.deceleration_mps2 / 2)
    target_m = real.speed_mps * real.demands[-1][0] + stopping_m
    estimator = known.parameters(real, FITTED[sensors])
    if "fix" in FITTED[sensors].sensors:
        line = folder.resolve() / TRACK_LINE  # so that it is found from everywhere
        write_text(line, centre_line.geojson())
        estimator |= {"track_line": str(line), "track_start_m": centre_line.BEGINS_M}
    simulator, monitor = {"scenario": scenario, "sensors": sensors}, {"target_position_m": target_m}
    return Task(seed, simulator, {**monitor, "target_speed_kmh": 0.0}, estimator)
