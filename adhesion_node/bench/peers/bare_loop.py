# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""One normal equation with its linearisation as a bare compiled loop: of a level line, straight from the formulas.

As little as a machine can do for it: nothing is checked, named or kept, and every array is there already.
"""

from ...core.compiled import kernel
from ...core.physics.train import Array

G = 9.8


@kernel
def stepped(window: Array, model: Array, prior: Array, precision: Array, x: Array, kappa: float, work: Array) -> float:
    """Solve for the step of the trajectory `x`, (K + 1, 2), into the last row of `work`, (6, 2K + 2); return kappa's.

    `window` has rows dt, brake, position, variance; `model` is c0, c1, c2, floor, gain, offset, q_s, q_v.
    """
    pivot, near, right, border = work[0], work[1], work[3], work[4]
    work[:] = 0.0
    corner, push = precision[2, 2], 0.0
    for i in range(3):
        off = prior[i] - (x[0, i] if i < 2 else kappa)
        push += precision[2, i] * off
        right[0] += precision[0, i] * off
        right[1] += precision[1, i] * off
    pivot[0], pivot[1], near[1] = precision[0, 0], precision[1, 1], precision[0, 1]
    border[0], border[1] = precision[0, 2], precision[1, 2]
    more, pushed = _assembled(window, model, x, kappa, work)
    return _solved(corner + more, push + pushed, work)


@kernel
def _assembled(window: Array, model: Array, x: Array, kappa: float, work: Array) -> tuple[float, float]:
    pivot, near, far, right, border = work[0], work[1], work[2], work[3], work[4]
    corner, push = 0.0, 0.0
    for k in range(window.shape[1]):
        dt, brake, v, i = window[0, k], window[1, k], x[k, 1], 2 * k
        over = model[5] + 3.6 * v
        law, bends = model[3] + model[4] / over, -3.6 * model[4] / over**2
        limited = kappa * law >= brake
        slope = model[1] + 2.0 * model[2] * v + (0.0 if limited else kappa * bends)
        resisting = model[0] + v * (model[1] + v * model[2])
        slower = v - dt * G * ((brake if limited else kappa * law) + resisting)
        kept = 1.0 - dt * G * slope
        half, effect = 0.5 * dt * (1.0 + kept), 0.0 if limited else -dt * G * law
        sure_s, sure_v, seen = 1.0 / (model[6] * dt), 1.0 / (model[7] * dt), 1.0 / window[3, k]
        force_s, force_v = sure_s * (x[k + 1, 0] - x[k, 0] - 0.5 * dt * (v + slower)), sure_v * (x[k + 1, 1] - slower)
        to_s, to_v = sure_s * 0.5 * dt * effect, sure_v * effect
        pivot[i] += sure_s
        pivot[i + 1] += sure_s * half**2 + sure_v * kept**2
        pivot[i + 2], pivot[i + 3] = sure_s + seen, sure_v
        near[i + 1] += sure_s * half
        near[i + 2], far[i + 2], far[i + 3] = -sure_s * half, -sure_s, -sure_v * kept
        right[i] += force_s
        right[i + 1] += half * force_s + kept * force_v
        right[i + 2], right[i + 3] = seen * (window[2, k] - x[k + 1, 0]) - force_s, -force_v
        border[i] += to_s
        border[i + 1] += half * to_s + kept * to_v
        border[i + 2], border[i + 3] = -to_s, -to_v
        corner += effect * (0.5 * dt * to_s + to_v)
        push += effect * (0.5 * dt * force_s + force_v)
    return corner, push


@kernel
def _solved(corner: float, push: float, work: Array) -> float:
    pivot, near, far, right, border, moved = work[0], work[1], work[2], work[3], work[4], work[5]
    for i in range(moved.size):
        if i > 1:
            near[i] -= far[i] * near[i - 1]
            across, far[i] = far[i], far[i] * pivot[i - 2]
            pivot[i] -= across * far[i]
            right[i] -= far[i] * right[i - 2]
            border[i] -= far[i] * border[i - 2]
        if i > 0:
            across, near[i] = near[i], near[i] * pivot[i - 1]
            pivot[i] -= across * near[i]
            right[i] -= near[i] * right[i - 1]
            border[i] -= near[i] * border[i - 1]
        pivot[i] = 1.0 / pivot[i]
        corner -= border[i] ** 2 * pivot[i]
        push -= border[i] * right[i] * pivot[i]
    change = push / corner
    for i in range(moved.size - 1, -1, -1):
        moved[i] = (right[i] - change * border[i]) * pivot[i]
        if i + 1 < moved.size:
            moved[i] -= near[i + 1] * moved[i + 1]
        if i + 2 < moved.size:
            moved[i] -= far[i + 2] * moved[i + 2]
    return change
