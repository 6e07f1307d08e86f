# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A header in the midst of a log, as where a recorder was started anew, or logs were joined."""

from collections.abc import Sequence


def is_header(cells: Sequence[str], names: Sequence[str]) -> bool:
    """Return whether a row names columns again."""
    return bool(cells) and cells[0][:1].isalpha() and 2 * len({*cells} & {*filter(None, names)}) >= len({*names})


def require_same(cells: Sequence[str], names: Sequence[str], where: str) -> None:
    """Raise ValueError where another header begins: what is below would be read as the columns of the first."""
    if list(cells) != list(names):
        raise ValueError(f"{where}: another header, {list(cells)} after {list(names)}: cut the log there")
