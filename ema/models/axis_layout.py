"""Rows of the axis model's parameter array (see `layout` for the three-phase one)."""

from __future__ import annotations

from ema.effects import registry

# F_s, F_d: static and sliding friction; V_dc: supply without load; dT: winding temperature less 20 °C
# load: torque of a known load at the moment, as a record has it
PARAMETERS = ("J", "C", "F_s", "F_d", "k_t", "k_e", "R", "L", "V_dc", "K_w", "I_max", "dT", "load")
# Cogging lines are a table of their own, since a motor has several.
_effects = tuple(
    f"{name}.{p.name}" for name, effect in registry().items() if "axis" in effect.plants for p in effect.parameters
)
ROWS = {name: row for row, name in enumerate((*PARAMETERS, *_effects))}
N_ROWS = len(ROWS)


def row(name: str) -> int:
    """Row of a parameter (``"J"``) or of an effect's parameter (``"stribeck.speed"``)."""
    return ROWS[name]
