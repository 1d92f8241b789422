"""Rows of the flat array that holds all of a batch: state, parameters and inputs of every run.

Row r of lane l is element ``r * n_lanes + l`` of ONE array: with an array per quantity the compiler cannot rule out
that they overlap, does not vectorise, and the batch costs three times as much.
"""

from __future__ import annotations

from ema.effects import registry

# What a run carries from one cycle into the next.
# s_*: comparators, off_*: time until the leg is on, lag1_*, lag2_*: anti-alias stages.
STATE = (
    *("i_a", "i_b", "i_c", "theta_m", "w_m", "theta_u", "w_u", "s_a", "s_b", "s_c", "off_a", "off_b", "off_c"),
    *("lag1_a", "lag1_b", "lag1_c", "lag2_a", "lag2_b", "lag2_c", "u_dc", "angle_error", "I_ref"),
)
# What stays as it is during a run.
PARAMETERS = (
    *("R_a", "R_b", "R_c", "L_a", "L_b", "L_c", "k_a", "k_b", "k_c", "p", "theta_0", "zeta", "phi"),
    *(
        "V_dc",
        "h",
        "I_max",
        "J_m",
        "C",
        "F_s",
        "F_d",
        "GR",
        "b",
        "F_u",
        "theta_stop",
        "K_p",
        "K_w",
        "lvdt_step",
        "f_lag",
        "dT",
    ),
)
# Running sums of energy, kept only when a run is audited. [J]
ENERGIES = ("E_electric", "E_copper", "E_shaft", "E_friction", "E_user")

_effects = tuple(f"{name}.{p.name}" for name, effect in registry().items() for p in effect.parameters)
ROWS = {name: row for row, name in enumerate((*STATE, *PARAMETERS, *ENERGIES, *_effects))}
N_STATE = len(STATE)
N_ROWS = len(ROWS)


def row(name: str) -> int:
    """Row of a quantity (``"w_m"``) or of an effect's parameter (``"cogging.order"``)."""
    return ROWS[name]
