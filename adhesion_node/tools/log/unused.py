# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Options that say how something is written which a log has not: whoever gives one believes that it has."""

from ...command.checks import refuse
from .format import FAMILIES, Format
from .whole import Log


def refuse_unused(asked: Format, log: Log) -> None:
    """Raise ValueError for the first option of `asked` that means nothing for the log which was read by it."""
    there = {*log.columns.names, *(["wheel_speed"] if log.columns.axles else [])}
    families = {FAMILIES[column] for column in there & FAMILIES.keys()}
    for family in dict.fromkeys(FAMILIES.values()):
        if family not in families:
            refuse(asked, [f"{family}_unit"], f"the log has no {family}: leave it out, or name the column")
    if "brake_pipe" not in there:
        refuse(asked, ["pipe_released"], "the log has no brake_pipe: leave it out, or name the column with --pipe")
    if asked.time_format is not None:
        refuse(asked, ["time_unit"], "dates by --time-format have no unit: leave the one or the other out")
    if log.form.time_format is None and asked.time_zone != "UTC":
        unit = log.form.time_unit
        raise ValueError(f"--time-zone {asked.time_zone}: the times are numbers, in {unit}, of UTC: leave it out")
