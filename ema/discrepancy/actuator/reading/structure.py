"""What an unexplained residual looks like: orders, frequencies, and what it depends on."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ema.core.records import Array

from .weak import Torque, lines, share_explained

N_BINS = 12
LEAST_NODES = 3.0  # in a part of a function, for its mean to be told
WORTH_SAYING = 0.3  # share of the residual torque
FREQUENCIES = np.arange(5.0, 450.0, 0.5)


def _bins(signal: Callable[[Torque], Array], low: float, high: float) -> Callable[[Torque], Array]:
    """Piecewise-constant function of a signal."""
    edges = np.linspace(low, high, N_BINS + 1)[1:-1]
    return lambda c: (np.digitize(signal(c), edges)[None] == np.arange(N_BINS)[:, None]).astype(float)


def _tone(frequency: float, rate: float) -> Callable[[Torque], Array]:
    """A torque at a fixed frequency, with its own phase in each cycle left to `share_by_cycle`."""

    def terms(c: Torque) -> Array:
        angle = 2.0 * np.pi * frequency * np.arange(len(c.theta_m)) / rate
        return np.stack([np.cos(angle), np.sin(angle)])

    return terms


def _share_by_cycle(cycles: Sequence[Torque], terms: Callable[[Torque], Array]) -> float:
    """Share of the residual explained if every cycle has its own coefficients."""
    power = [float(((c.r / c.sd) ** 2).sum()) for c in cycles]
    shares = [share_explained([c], terms)[0] for c in cycles]
    return float(np.average(shares, weights=power)) if sum(power) > 0.0 else 0.0


def function(
    cycles: Sequence[Torque], of: str, signal: Callable[[Torque], Array], low: float, high: float
) -> dict[str, Any]:
    """The residual torque as a function of one signal: its mean in each part of the range that was passed through.

    Returns
    -------
    function : dict
        ``of``; ``at``, the parts' middles; ``torque`` there, opposing positive motion [N m]; ``share`` explained.
    """
    terms = _bins(signal, low, high)
    share, torque = share_explained(cycles, terms)
    seen = sum(np.asarray(c.averaged(terms(c)).sum(axis=1)) for c in cycles) > LEAST_NODES
    middle = low + (np.arange(N_BINS) + 0.5) * (high - low) / N_BINS
    return {"of": of, "at": middle[seen].tolist(), "torque": torque[seen].tolist(), "share": round(float(share), 3)}


def structure(cycles: Sequence[Torque], rate: float, scores: dict[str, float]) -> dict[str, Any]:
    """Orders, frequencies and dependences of the residual torque, and where in the actuator it stands out.

    Parameters
    ----------
    scores : dict
        z-score of each feature group (see `noise.verdict`).
    """
    orders = [{"order": of.order, "amplitude": of.amplitude, "share": of.share} for of in lines(cycles)]
    tones = np.array([_share_by_cycle(cycles, _tone(f, rate)) for f in FREQUENCIES])
    peak = int(np.argmax(tones))
    smooth_sign: Callable[[Torque], Array] = lambda c: np.tanh(c.w_m / 2.0)  # noqa: E731
    speed = max(float(np.abs(c.w_m).max()) for c in cycles)
    position = [min(c.theta_u.min() for c in cycles), max(c.theta_u.max() for c in cycles)]
    turn: Callable[[Torque], Array] = lambda c: c.theta_m % (2.0 * np.pi)  # noqa: E731
    functions = [
        function(cycles, "speed", lambda c: c.w_m, -speed, speed),
        function(cycles, "position", lambda c: c.theta_u, float(position[0]), float(position[1])),
        function(cycles, "rotor angle", turn, 0.0, 2.0 * np.pi),
    ]
    dependence = {
        "sign of speed": share_explained(cycles, lambda c: smooth_sign(c)[None])[0],
        **{f["of"]: f["share"] for f in functions},
    }
    loudest = sorted(scores, key=lambda name: -scores[name])
    said = [f"most visible in the {' and '.join(n for n in loudest if n != 'all')[:40].rsplit(' and', 1)[0]} balance"]
    best = orders[0]
    if best["share"] > WORTH_SAYING and best["share"] > tones[peak]:
        said.append(f"a torque line of {best['amplitude']:.2g} N m at {best['order']:.4g} periods per rotor turn")
    elif tones[peak] > WORTH_SAYING:
        said.append(f"a torque at {FREQUENCIES[peak]:.3g} Hz whatever the motion")
    for name, share in sorted(dependence.items(), key=lambda item: -item[1])[:2]:
        if share > WORTH_SAYING:
            said.append(f"{share:.0%} of the residual torque is a function of {name}")
    return {
        "sentences": said,
        "groups": {name: round(float(z), 1) for name, z in scores.items()},
        "orders": orders,
        "frequencies": [{"frequency": float(FREQUENCIES[peak]), "share": float(tones[peak])}],
        "dependence": {name: round(float(share), 3) for name, share in dependence.items()},
        "functions": [f for f in functions if f["share"] > WORTH_SAYING],
    }
