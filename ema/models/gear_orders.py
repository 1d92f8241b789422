"""Orders at which a gear errs, per turn of the motor: of its wheels, teeth and waves.

References
----------
Smith, "Gear Noise and Vibration", 2nd edition, Marcel Dekker 2003, chapter 1 (orders of meshes and planets).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence


def gear_orders(kind: str, ratio: float, teeth: Sequence[int]) -> Mapping[float, str]:
    """Orders per motor turn, each with what turns or meshes at it.

    Parameters
    ----------
    kind : str
        harmonic (strain wave, circular spline fixed), planetary (ring fixed, the sun drives) or spur.
    ratio : float
        Turns of the motor per turn of the load.
    teeth : sequence of int
        Planetary: of sun and ring. Spur: of driving and driven wheel, stage by stage. Harmonic: not needed.
    """
    of_kind = {"harmonic": _harmonic, "planetary": _planetary, "spur": _spur}[kind]
    return {**of_kind(ratio, teeth), 1.0 / ratio: "the output, once per turn"}


def _harmonic(ratio: float, teeth: Sequence[int]) -> dict[float, str]:
    return {2.0: "the wave generator's two lobes", 4.0: "the wave generator's two lobes, twice"}


def _planetary(ratio: float, teeth: Sequence[int]) -> dict[float, str]:
    """Against the carrier the sun makes Z_r/(Z_s + Z_r) turns."""
    sun, ring = teeth
    planet = 0.5 * (ring - sun)
    relative = ring / (sun + ring)
    return {
        sun * relative: "the mesh of sun, planets and ring",
        sun / planet * relative: "a planet, once per turn",
        2.0 * sun / planet * relative: "a planet's tooth, at sun and ring",
    }


def _spur(ratio: float, teeth: Sequence[int]) -> dict[float, str]:
    orders, turns = {}, 1.0
    for stage, (driving, driven) in enumerate(zip(teeth[::2], teeth[1::2], strict=True), start=1):
        orders[driving * turns] = f"the mesh of stage {stage}"
        turns *= driving / driven
        orders[turns] = f"the driven wheel of stage {stage}, once per turn"
    return orders
