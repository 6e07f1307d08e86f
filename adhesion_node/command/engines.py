# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Where tasks are computed: by processes of this machine, or by an existing Dask cluster; both are executors."""

import errno
import logging
import multiprocessing
import os
import re
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing.connection import Connection

THREADS = "OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"
"""How many threads a process's linear algebra takes: by themselves as many as cores, in each worker."""

CONNECT_S = 10.0
"""How long a scheduler may take to answer."""


@contextmanager
def processes(workers: int) -> Iterator[Executor]:
    """Give an executor of worker processes, which end with the block or with this process, whatever ends it.

    Each has one thread, unless the environment says otherwise. Raises OSError when a worker was killed.
    """
    for name in THREADS:
        os.environ.setdefault(name, "1")
    lifeline, held = multiprocessing.Pipe(duplex=False)
    spawn = multiprocessing.get_context("spawn")  # a fork would copy threads in any state
    with lifeline, ProcessPoolExecutor(workers, spawn, _be_a_worker, (lifeline,)) as executor, held:
        try:
            yield executor
        except BrokenProcessPool as error:
            reason = "a worker was killed, by lack of memory perhaps: give fewer --workers"
            raise OSError(errno.ECHILD, reason, "workers") from error


@contextmanager
def cluster(address: str) -> Iterator[Executor]:
    """Give an executor on the Dask cluster of the scheduler at `address`; what is not done is cancelled at the end.

    Raises ValueError for what is no address or without dask.distributed, OSError when the cluster cannot be reached,
    breaks off or lacks this package.
    """
    try:
        from distributed import CancelledError, Client, KilledWorker
    except ImportError as error:
        raise ValueError(f"scheduler = {address}: needs the extra cluster, pip install '.[cluster]'") from error
    if not re.fullmatch(r"(\w+://)?[^/]+:\d+", address):
        raise ValueError(f"scheduler = {address}: write tcp://HOST:PORT")
    logging.getLogger("distributed.client").setLevel(logging.CRITICAL)  # what matters is raised, in one line
    try:
        client = Client(address, timeout=CONNECT_S, set_as_default=False)
    except ValueError as error:
        raise ValueError(f"scheduler = {address}: {error}: write tcp://HOST:PORT") from error
    except OSError as error:
        raise OSError(errno.EHOSTUNREACH, f"no Dask scheduler answered within {CONNECT_S:g} s", address) from error
    with client:
        try:
            yield client.get_executor(pure=False)
        except (CancelledError, KilledWorker) as error:
            raise OSError(errno.EPIPE, "the cluster broke off: the same command goes on", address) from error
        except (ImportError, RuntimeError) as error:
            reason = f"install this package, in one version, for the scheduler and every worker ({error})"
            raise OSError(errno.ENOPKG, reason, address) from error


def _be_a_worker(lifeline: Connection) -> None:
    """Leave Ctrl-C to the parent and the machine usable; end when the parent has let go of the other end."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.nice(5)
    threading.Thread(target=_end_with, args=(lifeline,), daemon=True).start()


def _end_with(lifeline: Connection) -> None:
    lifeline.poll(None)  # nothing is ever sent: only the end of the other side wakes it
    os._exit(1)
