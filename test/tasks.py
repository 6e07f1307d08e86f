# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

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
