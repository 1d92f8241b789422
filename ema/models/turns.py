"""Which turn a rotor is in: a resolver does not know, the user's position does."""

from __future__ import annotations

import numpy as np

TURN = 2.0 * np.pi


def nearest_turn(theta_u: float, theta_m: float, GR: float) -> float:
    """Whole turns [rad] to add to the rotor angle so that it is nearest to the user's position times the gear ratio.

    Backlash and twist of the gear are much less than the 2π/GR that a turn moves the user.
    """
    return TURN * float(np.round((theta_u * GR - theta_m) / TURN))
