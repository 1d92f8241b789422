"""From the structure of an unexplained residual to effects that a plant file can carry."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ema.discrepancy.actuator.reading.structure import WORTH_SAYING
from ema.effects import registry
from ema.effects.table import tabulated

# Effects that hold a function of one quantity. Of the rotor's angle a torque line says more than a table would.
TABLES = {"position": "position_torque", "speed": "speed_torque"}


def write_extension(structure: Mapping[str, Any]) -> dict[str, dict[str, float]]:
    """The section ``effects`` that stands for what a structure says as a function, empty where it says none.

    Of the functions that explain enough of the residual the one that explains most is taken: functions of position and
    of speed are not independent of each other along a motion, and two would say the same torque twice.

    Parameters
    ----------
    structure : mapping
        As in findings.json. Its entry ``functions`` is a list of mappings: ``of``, the quantity (``position``,
        ``speed``); ``at``, ascending places of it (n,) [rad, rad/s]; ``torque`` there (n,), opposing positive motion
        [N m]; ``share`` of the residual torque that the function explains.

    Returns
    -------
    effects : dict of effect to values
        As in `Actuator.effects`.
    """
    found = [f for f in structure.get("functions", []) if f["of"] in TABLES and f["share"] > WORTH_SAYING]
    for function in sorted(found, key=lambda f: -f["share"]):
        name, at = TABLES[function["of"]], np.asarray(function["at"], dtype=float)
        if len(at) > 1 and (np.diff(at) > 0.0).all():
            values = dict(tabulated(at, function["torque"]))
            if all(p.low <= values[p.name] <= p.high for p in registry()[name].parameters):
                return {name: values}
    return {}
