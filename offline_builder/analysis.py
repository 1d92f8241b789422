"""From the envelopes of a plan to the arrays of a bundle."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ema.core.names import FAULTS
from ema.models.actuator import Actuator
from ema.models.layout import STATE
from ema.models.lf2 import Lf2
from ema.reduction.pod import pod
from ema.reduction.schedules import Knowledge, schedule

from .config import Builder
from .library import fit_library
from .runs import START_OFFSET, Plan

THETA_U, THETA_M = STATE.index("theta_u"), STATE.index("theta_m")


def jacobian(
    envelopes: np.ndarray, plan: Plan, builder: Builder, i0: np.ndarray, noise_rms: float
) -> tuple[np.ndarray, np.ndarray]:
    """∂i/∂k at k = 0 over the whole cycle (n_t, 6), and the step taken for each fault (6,).

    One-sided differences, averaged over seeds. A difference must stand above the switching noise left in it, and no
    further: of the candidate steps the smallest is taken whose ‖Δi‖ exceeds that noise `signal_to_noise` times.
    """
    columns, steps = [], []
    limit = builder.jacobian.signal_to_noise * noise_rms * np.sqrt(1 / builder.n_seeds + 1 / builder.n_noise)
    for fault in FAULTS:
        for step in builder.jacobian.steps:
            difference = envelopes[plan.groups[f"step {fault} {step:g}"]].mean(axis=0, dtype=float) - i0
            if np.sqrt(np.mean(difference**2)) > limit:
                break
        columns.append(difference / step)
        steps.append(step)
    return np.column_stack(columns), np.array(steps)


def covariance(x: np.ndarray) -> np.ndarray:
    """Covariance of the columns of `x` (n, m), lightly shrunk towards its diagonal so that it can be inverted."""
    n = len(x)
    S = np.cov(x, rowvar=False)
    shrink = min(0.5, x.shape[1] / (2.0 * n))
    return (1.0 - shrink) * S + shrink * np.diag(np.diag(S))


def start_influence(x: np.ndarray, s: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Linear influence of the start state and the spread it leaves.

    Parameters
    ----------
    x : array, shape (n, n_omega)
        Deviation of the envelope from the nominal one at the schedule. [A]
    s : array, shape (n, 2)
        Start: user position, gear output θ_m/GR. [rad]

    Returns
    -------
    B (n_omega, 2), covariance of the rest per unit distance² (n_omega, n_omega), scale of the start (2,)
    """
    B = np.linalg.lstsq(s, x, rcond=None)[0].T
    scale = np.full(2, START_OFFSET)
    distance2 = np.sum((s / scale) ** 2, axis=1)
    rest = (x - s @ B.T) / np.sqrt(np.maximum(distance2, 0.05))[:, None]
    return B, covariance(rest), scale


def model_error(error: np.ndarray, k: np.ndarray, noise: np.ndarray) -> np.ndarray:
    """Covariance M of a model's error, E[e eᵀ] = Σ_switch + ‖k‖⁴ M, by weighted regression over a campaign.

    Parameters
    ----------
    error : array, shape (n, n_omega)
        HF less model. [A]
    """
    q = np.sum(k**2, axis=1)  # ‖k‖²
    weight = 1.0 / (np.median(q) + q) ** 2  # small faults must count as much as large ones
    S = np.einsum("n,ni,nj->ij", weight, error, error) - weight.sum() * noise
    M = S / np.sum(weight * q**2)
    lam, U = np.linalg.eigh(0.5 * (M + M.T))
    return (U * np.maximum(lam, 1e-12 * lam.max())) @ U.T


def analyse(
    envelopes: np.ndarray, plan: Plan, plant: Actuator, builder: Builder, say: Callable[[str], None] = lambda text: None
) -> tuple[dict[str, np.ndarray], dict[str, float]]:
    """All arrays of the bundle, and the figures worth printing."""
    nominal = envelopes[plan.groups["nominal"]].astype(float)
    i0 = nominal.mean(axis=0)
    noise_rms = nominal.std(axis=0, ddof=1)

    say("Jacobian")
    A_full, steps = jacobian(envelopes, plan, builder, i0, float(np.sqrt(np.mean(noise_rms**2))))

    say("POD")
    campaign = envelopes[plan.groups["campaign"]]
    modes = pod(campaign, i0, seed=builder.seed)

    say(f"schedule ({builder.schedule.method})")
    know = Knowledge(plant.time(), modes.v[:, 0], A_full, (nominal - i0).T @ (nominal - i0) / (len(nominal) - 1))
    points = schedule(builder.schedule.method, know, builder.schedule.n_points, builder.seed)

    say("LF2 library")
    lf2 = fit_library(envelopes, plan, builder, i0)

    say("noise")
    switching = covariance(nominal[:, points] - i0[points])
    starts = plan.groups["start"]
    s = np.column_stack([plan.start[starts, THETA_U], plan.start[starts, THETA_M] / plant.transmission.GR])
    B, start_rest, scale = start_influence(envelopes[starts][:, points].astype(float) - i0[points], s)

    k = plan.k[plan.groups["campaign"]]
    at = campaign[:, points].astype(float)
    A = A_full[points]
    Q, R = np.linalg.qr(A)
    arrays = {
        "i0": i0, "noise_rms": noise_rms, "A_full": A_full, "A": A, "A_step": steps, "Q": Q, "R": R,
        "v1": modes.v[:, 0], "eigenvalue_share": modes.share, "schedule": points.astype(np.int64),
        "noise_switching": switching, "noise_start": start_rest, "start_B": B, "start_scale": scale,
        "model_error_linear": model_error(at - i0[points] - k @ A.T, k, switching),
        "model_error_lf2": model_error(at - lf2.at(points)(k), k, switching),
        **{name: getattr(lf2, name) for name in Lf2.__dataclass_fields__ if name != "i0"},
    }  # fmt: skip
    figures = {
        "noise_rms_A": float(np.sqrt(np.mean(noise_rms**2))),
        "lambda_1_share": float(modes.share[0]),
        "n_runs": float(len(plan)),
    }
    return arrays, figures
