# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Whether there is what an option names: an encoding, a time zone, a format of dates."""

from collections.abc import Callable
from datetime import datetime
from typing import Any
from zoneinfo import ZoneInfoNotFoundError


def decodes(encoding: str) -> None:
    """Raise one of `NO_TEXT` for an encoding that is none."""
    b"a".decode(encoding, "replace")


def require_format(time_format: str) -> None:
    """Raise ValueError for a format that strptime does not know."""
    try:
        datetime.strptime("", time_format)
    except ValueError as error:
        if "does not match" not in str(error):
            raise ValueError(f"time-format = {time_format!r}: {error}; give one such as %d.%m.%Y %H:%M:%S.%f") from None


NO_TEXT = (LookupError, UnicodeError)
"""What is raised for an encoding that is none, or none of text."""

NO_ZONE = (ZoneInfoNotFoundError, ValueError, OSError)
"""What `ZoneInfo` raises for a name that is none, or a folder."""


def require(find: Callable[[str], Any], errors: Any, name: str, value: str, such_as: str) -> None:
    """Raise ValueError where what is to be found of this name is not."""
    try:
        find(value)
    except errors:
        raise ValueError(f"{name} = {value!r}: there is none of this name; give one {such_as}") from None
