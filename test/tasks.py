# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Tasks without worker processes, for tests of what is computed; what the processes do is tested in test_running."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

import pytest

from adhesion_node.command import engines


@contextmanager
def computed_here() -> Iterator[None]:
    """Compute tasks by one thread of this process: a worker process would import everything anew."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(engines, "processes", lambda _: ThreadPoolExecutor(1))
        yield
