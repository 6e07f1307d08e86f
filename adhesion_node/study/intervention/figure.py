# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""The supervision limits over the distance, as ETCS draws them, by the lower bound and by the fixed worst case."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from ...core.atp import limits as etcs
from ...core.atp.config import SupervisionConfig
from ...core.physics.braking import BrakingCurve
from ...core.physics.train import KMH
from ...report.picture import BLACK, BLUE, GREY, ORANGE
from ..trial.drawing import PAGE_IN, picture

NAMES = {
    "ebi": ("emergency brake intervention (EBI)", "#b00020", "-"),
    "sbi": ("service brake intervention (SBI)", ORANGE, "-"),
    "warning": ("warning (W)", ORANGE, "--"),
    "permitted": ("permitted speed (P)", BLACK, "-"),
    "indication": ("indication (I)", GREY, "-"),
}
"""Label, colour and line of each limit."""


def draw(config: SupervisionConfig, safe: BrakingCurve, fixed: BrakingCurve, title: str, path: Path) -> None:
    """Draw the limits of `safe` and the emergency intervention of `fixed` into a PNG, or what the ending says.

    The line speed is that of the beginning of `safe`.
    """
    config = replace(config, line_speed_kmh=float(safe.speed_mps[0]) / KMH)
    reach = float(etcs.distances(config, safe, safe.speed_mps[:1]).indication[0])
    ahead = np.linspace(1.1 * reach, -0.1 * reach, 600)
    with picture(path, title, (PAGE_IN, 3.6)) as axis:
        for name, limit in etcs.speeds(config, safe, ahead)._asdict().items():
            label, color, style = NAMES[name]
            axis.plot(ahead, limit / KMH, color=color, ls=style, label=label)
        by_fixed = etcs.speeds(config, fixed, ahead).ebi
        axis.plot(ahead, by_fixed / KMH, color=BLUE, ls=":", label="EBI by the fixed worst case")
        axis.axvline(0.0, color=GREY, lw=0.8)
        axis.annotate(" target", (0.0, 0.02), xycoords=("data", "axes fraction"), color="0.25")
        axis.set(xlabel="distance to the target, m", ylabel="speed, km/h", xlim=(ahead[0], ahead[-1]))
        axis.set_ylim(bottom=0.0)
        axis.legend(loc="lower left", fontsize="small")
