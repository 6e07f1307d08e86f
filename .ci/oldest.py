# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Print the oldest packages that setup.py allows, as constraints for pip: of a range its first minor version."""

import re
import runpy
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from unittest import mock

SETUP = Path(__file__).resolve().parent.parent / "setup.py"


def oldest(requirement: str) -> str:
    """Return the constraint of a requirement.

    >>> oldest("numpy>=1.26,<3"), oldest("lz4>=4,<5"), oldest("rosbags>=0.11.6,<0.12")
    ('numpy==1.26.*', 'lz4==4.0.*', 'rosbags==0.11.6')
    """
    found = re.fullmatch(r"([\w-]+)>=(\d+)(\.\d+)?(\.\d+)?(,<[\d.]+)?", requirement)
    if found is None:
        raise ValueError(f"{SETUP}: requirement = {requirement!r}: write NAME>=OLDEST,<FIRST_UNTRIED")
    name, major, minor, patch, _ = found.groups()
    return f"{name}=={major}{minor or '.0'}{patch or '.*'}"


def constraints() -> Iterator[str]:
    """Yield those of what the package needs, and of its tools."""
    with mock.patch("setuptools.setup") as setup:
        runpy.run_path(str(SETUP))
    told: dict[str, Any] = setup.call_args.kwargs
    yield from map(oldest, [*told["install_requires"], *told["extras_require"]["tools"]])


if __name__ == "__main__":
    print(*constraints(), sep="\n")
