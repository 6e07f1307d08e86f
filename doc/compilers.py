# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Compilers of numerical Python side by side: one loop, simplified from the prediction of 40 hypotheses.

python -m venv /tmp/compilers && /tmp/compilers/bin/pip install numpy numba cython pythran setuptools
/tmp/compilers/bin/python doc/compilers.py      # needs gcc, which cython and pythran build with
"""

import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

ROUNDS = 3

LOOP = """
    H = mean.shape[0]
    for h in range(H):
        v = mean[h, 1]
        res = c0 + v * (c1 + c2 * v)
        needed = mean[h, 4] * applied
        rail = mean[h, 2] * (1.0 + mean[h, 3])
        u = rail if rail < needed else needed
        slower = v - dt * 9.8 * (u + res + mean[h, 5])
        way_m = max(v, 0.1) * dt
        lasting[3] = exp(-way_m / 100.0)
        lasting[5] = exp(-way_m / 1500.0)
        lasting[6] = exp(-dt / 30.0)
        for i in range(10):
            means[h, i] = lasting[i] * mean[h, i]
            fall[i] = 0.0
            way[i] = 0.0
        means[h, 1] = slower
        means[h, 0] = mean[h, 0] + 0.5 * dt * (v + slower)
        fall[2] = -dt * 9.8 * (1.0 + mean[h, 3])
        fall[3] = -dt * 9.8 * mean[h, 2]
        fall[5] = -dt * 9.8
        fall[1] = 1.0 - dt * 9.8 * (c1 + 2.0 * c2 * v)
        for i in range(10):
            way[i] = 0.5 * dt * fall[i]
        way[1] = way[1] + 0.5 * dt
        way[0] = 1.0
        ff = 0.0
        wf = 0.0
        ww = 0.0
        for i in range(10):
            a = 0.0
            b = 0.0
            for j in range(10):
                a += cov[h, i, j] * fall[j]
                b += cov[h, i, j] * way[j]
                covs[h, i, j] = lasting[i] * lasting[j] * cov[h, i, j]
            by_fall[i] = a
            by_way[i] = b
            ff += fall[i] * a
            wf += way[i] * a
            ww += way[i] * b
        for i in range(10):
            covs[h, 1, i] = lasting[i] * by_fall[i]
            covs[h, i, 1] = lasting[i] * by_fall[i]
            covs[h, 0, i] = lasting[i] * by_way[i]
            covs[h, i, 0] = lasting[i] * by_way[i]
        covs[h, 1, 1] = ff
        covs[h, 0, 0] = ww
        covs[h, 0, 1] = wf
        covs[h, 1, 0] = wf
        for i in range(10):
            covs[h, i, i] += 1e-6
"""

EMPTY = """
    means = np.empty_like(mean)
    covs = np.empty_like(cov)
    lasting = np.ones(10)
    fall = np.zeros(10)
    way = np.zeros(10)
    by_fall = np.zeros(10)
    by_way = np.zeros(10)
"""

HEAD = "import numpy as np\nfrom math import exp\n"
DEFINED = "def moved(mean, cov, dt, applied, c0, c1, c2):"
RETURN = "    return means, covs\n"

NUMPY = """
import numpy as np
E = np.arange(10)
def moved(mean, cov, dt, applied, c0, c1, c2):
    v = mean[:, 1]
    res = c0 + v * (c1 + c2 * v)
    u = np.minimum(mean[:, 2] * (1 + mean[:, 3]), mean[:, 4] * applied)
    slower = v - dt * 9.8 * (u + res + mean[:, 5])
    way_m = np.maximum(v, 0.1) * dt
    lasting = np.ones(mean.shape)
    lasting[:, 3], lasting[:, 5], lasting[:, 6] = np.exp(-way_m / 100), np.exp(-way_m / 1500), np.exp(-dt / 30)
    means = mean * lasting
    means[:, 1], means[:, 0] = slower, mean[:, 0] + 0.5 * dt * (v + slower)
    fall = np.zeros(mean.shape)
    fall[:, 2], fall[:, 3], fall[:, 5] = -dt * 9.8 * (1 + mean[:, 3]), -dt * 9.8 * mean[:, 2], -dt * 9.8
    fall[:, 1] = 1 - dt * 9.8 * (c1 + 2 * c2 * v)
    way = 0.5 * dt * fall
    way[:, 1] += 0.5 * dt
    way[:, 0] = 1.0
    step = np.zeros(cov.shape)
    step[:, E, E] = lasting
    step[:, 1], step[:, 0] = fall, way
    covs = step @ cov @ step.transpose(0, 2, 1)
    covs[:, E, E] += 1e-6
    return means, covs
"""

CYTHON = """# cython: boundscheck=False, wraparound=False, cdivision=True, language_level=3
import numpy as np
from libc.math cimport exp
def moved(double[:, ::1] mean, double[:, :, ::1] cov, double dt, double applied, double c0, double c1, double c2):
    made, spread = np.empty_like(mean), np.empty_like(cov)
    cdef double[:, ::1] means = made
    cdef double[:, :, ::1] covs = spread
    cdef double[::1] lasting = np.ones(10), fall = np.zeros(10), way = np.zeros(10)
    cdef double[::1] by_fall = np.zeros(10), by_way = np.zeros(10)
    cdef double v, res, needed, rail, u, slower, way_m, a, b, ff, wf, ww
    cdef int h, i, j, H
"""

PYTHRAN = "#pythran export moved(float64[:,:], float64[:,:,:], float, float, float, float, float)\n"
NUMBA = "from numba import njit\n@njit(cache=True, error_model='numpy')\n"

SOURCES = {
    "by_numpy.py": NUMPY,
    "by_numba.py": HEAD + NUMBA + DEFINED + EMPTY + LOOP + RETURN,
    "by_pythran.py": PYTHRAN + HEAD + DEFINED + EMPTY + LOOP + RETURN,
    "by_cython.pyx": CYTHON + LOOP + "    return made, spread\n",
}

TIMED = """
import sys, time
import numpy as np
root = np.random.default_rng(0).standard_normal((40, 10, 10))
given = np.abs(root[0][:1]) + np.ones((40, 10)), root @ root.transpose(0, 2, 1), 0.1, 0.09, 1e-3, 2e-5, 1e-6
start = time.perf_counter()
form = __import__(sys.argv[1])
imported = time.perf_counter()
form.moved(*given)
called, calls = time.perf_counter(), []
for _ in range(30):
    before = time.perf_counter()
    for _ in range(100):
        form.moved(*given)
    calls.append((time.perf_counter() - before) / 100)
print(f"{1e3 * (imported - start):8.1f} {1e3 * (called - imported):12.2f} {1e6 * np.median(calls):10.1f}")
"""


def main() -> None:
    """Build the forms in a folder of their own and time them in turns."""
    with TemporaryDirectory(prefix="adhesion_compilers_") as folder:
        here = Path(folder)
        for name, source in SOURCES.items():
            (here / name).write_text(source)
        for build in ("pythran -O3 by_pythran.py -o by_pythran.so", "cythonize -i -3 by_cython.pyx"):
            _run(here, *f"{Path(sys.executable).parent}/{build}".split())
        print(f"{'':14} import, ms  first call, ms  a call, us")
        for _ in range(ROUNDS):
            for form in ("by_numpy", "by_numba", "by_numba", "by_cython", "by_pythran"):
                print(f"{form:14} {_run(here, sys.executable, '-c', TIMED, form)}", end="")
            for kept in here.glob("__pycache__/by_numba*"):
                kept.unlink()


def _run(here: Path, *command: str) -> str:
    return subprocess.run(command, cwd=here, check=True, capture_output=True, text=True).stdout


if __name__ == "__main__":
    main()
