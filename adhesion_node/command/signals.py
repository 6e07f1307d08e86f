# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""SIGINT and SIGTERM as a request to stop. Standard library alone, so that it is there before anything heavy is."""

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


class StopRequest:
    """Whether SIGINT or SIGTERM has come. Later signals change nothing."""

    __slots__ = ("requested",)

    def __init__(self) -> None:
        self.requested = False


_watching: list[StopRequest] = []
"""The request that the handlers in force note in."""

_came: list[int] = []
"""The signals since a tool or a request began."""


def interrupted(program: str) -> int:
    """Say that a tool was; return its exit code: that of a failure, or of SIGTERM as shells have it, 143."""
    print(f"{program}: interrupted", file=sys.stderr)
    return 128 + signal.SIGTERM if signal.SIGTERM in _came else 1


def _interrupt(number: int, _frame: FrameType | None) -> None:
    _came.append(number)
    raise KeyboardInterrupt


@contextmanager
def interrupted_by_sigterm() -> Iterator[None]:
    """Let SIGTERM interrupt a tool as Ctrl-C does, so that no unfinished file is left; not where it is minded already.

    By itself it would end the process where that stands.
    """
    is_main = threading.current_thread() is threading.main_thread()
    if not is_main or signal.getsignal(signal.SIGTERM) is not signal.SIG_DFL:
        yield
        return
    _came.clear()
    signal.signal(signal.SIGTERM, _interrupt)
    try:
        yield
    finally:
        if signal.getsignal(signal.SIGTERM) is _interrupt:  # else it stays ignored behind a request to stop
            signal.signal(signal.SIGTERM, signal.SIG_DFL)


@contextmanager
def stop_on_signals(*, leaving: bool = True) -> Iterator[StopRequest]:
    """Turn SIGINT and SIGTERM into a request to stop; call it in the main thread. Inside another one it is that one's.

    After a signal both stay ignored for good where the program is then `leaving`: a second signal must not cut its exit
    short. Else, and without one, the earlier handlers return.
    """
    if _watching:
        yield _watching[0]
        return
    stop = StopRequest()

    def note(number: int, _frame: FrameType | None) -> None:
        stop.requested = True
        _came.append(number)

    _watching.append(stop)
    _came.clear()
    earlier = {number: signal.signal(number, note) for number in _SIGNALS}
    try:
        yield stop
    finally:
        _watching.clear()
        # Blocked meanwhile: a signal between two of these lines would be reported as lost in a race.
        signal.pthread_sigmask(signal.SIG_BLOCK, _SIGNALS)
        for number, handler in earlier.items():
            signal.signal(number, signal.SIG_IGN if stop.requested and leaving else handler)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, _SIGNALS)
