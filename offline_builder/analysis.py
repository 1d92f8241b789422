"""From the envelopes of a plan to the arrays of a bundle."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import least_squares

from ema.core.names import FAULTS
from ema.faults import N_FAULTS
from ema.identification.known_error import KnownError
from ema.models import lf1
from ema.models.actuator import Actuator
from ema.models.layout import STATE
from ema.models.lf2 import Lf2
from ema.reduction.pod import pod
from ema.reduction.schedules import Knowledge, schedule

from . import noise
from .config import Builder
from .library import fit_library
from .runs import Plan, paired
from .snapshots import READ, Snapshots

THETA_U, THETA_M = STATE.index("theta_u"), STATE.index("theta_m")


def jacobian(
    envelopes: Snapshots, plan: Plan, builder: Builder, i0: np.ndarray, noise_rms: float
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


def nuisance_jacobian(envelopes: Snapshots, plan: Plan, n_t: int) -> np.ndarray:
    """∂i/∂ν at zero over the whole cycle, shape (n_t, m): central differences, one-sided at a bound."""
    columns = []
    for j, name in enumerate(plan.nuisance.names, N_FAULTS):
        up, down = (plan.groups[f"step {name} {sign}"] for sign in ("+1", "-1"))
        distance = plan.x[up.start, j] - plan.x[down.start, j]
        columns.append((envelopes[up].mean(axis=0, dtype=float) - envelopes[down].mean(axis=0, dtype=float)) / distance)
    return np.column_stack(columns) if columns else np.zeros((n_t, 0))


def tuned(plant: Actuator, i0: np.ndarray) -> lf1.Tuning:
    """LF1 with the HF model's overall torque, EMF and friction: least squares on the nominal envelope."""

    def misfit(log_factors: np.ndarray) -> np.ndarray:
        return np.asarray(lf1.simulate(plant, np.zeros((1, 6)), lf1.Tuning(*np.exp(log_factors)))[0] - i0)

    return lf1.Tuning(*np.exp(least_squares(misfit, np.zeros(2), diff_step=0.02).x))


def analyse(
    envelopes: Snapshots, plan: Plan, plant: Actuator, builder: Builder, say: Callable[[str], None] = lambda text: None
) -> tuple[dict[str, np.ndarray], dict[str, float]]:
    """All arrays of the bundle, and the figures worth printing."""
    nominal = envelopes[plan.groups["nominal"]].astype(float)
    i0 = nominal.mean(axis=0)
    noise_rms = nominal.std(axis=0, ddof=1)

    say("Jacobian")
    A_full, steps = jacobian(envelopes, plan, builder, i0, float(np.sqrt(np.mean(noise_rms**2))))

    say("POD")
    modes = pod(envelopes.part(plan.groups["campaign"]), i0, seed=builder.seed)

    say(f"schedule ({builder.schedule.method})")
    know = Knowledge(plant.time(), modes.v[:, 0], A_full, nominal)
    points = schedule(builder.schedule.method, know, builder.schedule.n_points, builder.seed)

    say("LF2 library")
    lf2 = fit_library(envelopes, plan, builder, i0)

    say("noise")
    known, levels = {}, {}
    sets = noise.heldout(envelopes, plan, builder, points)
    S = noise.switching(nominal[:, points], sets)
    A = A_full[points]
    trained = [plan.groups[name] for name in ("campaign", "scaled")]
    at = np.vstack([plan.x[group] for group in trained])
    i = np.vstack([envelopes.part(group).at(points) for group in trained])
    N = nuisance_jacobian(envelopes, plan, plant.n_samples)[points]

    def linear(x: np.ndarray) -> np.ndarray:
        return i0[points] + x @ np.hstack([A, N]).T

    levels["linear"] = noise.model_error(linear, sets, S)
    tuning = tuned(plant, i0)
    simplified = lf1.anchored(plant, tuning, i0)

    def lf1_at_points(x: np.ndarray) -> np.ndarray:
        parts = np.split(x[:, :N_FAULTS], range(READ, len(x), READ))
        return np.vstack([simplified(part)[:, points] for part in parts])

    library = lf2.at(points)
    slope = np.vstack([np.zeros((N_FAULTS, len(points))), N.T])  # LF2 and LF1 know faults, but nothing beside them
    models: dict[str, noise.Model] = {"lf2": lambda x: library(x[:, :N_FAULTS]), "lf1": lf1_at_points}
    for name, model in models.items():
        known[name] = error = KnownError.fitted(at, i - model(at), noise.KNEE, slope)
        levels[name] = noise.model_error(noise.corrected(model, error), sets, S)
    sizes = [float(np.sqrt(np.mean(np.sum(k**2, axis=1)))) for k, _, _ in sets]

    starts, n = slice(plan.groups["start"].start, plan.groups["start, faulty"].stop), builder.n_start
    s = np.column_stack([plan.start[starts, THETA_U], plan.start[starts, THETA_M] / plant.transmission.GR])
    cold = np.zeros((starts.stop - starts.start, len(points))) + i0[points]
    twins = {k_max: 0.5 * (a + b) for k_max, (_, a, b) in zip(builder.heldout.k_max, sets, strict=True)}
    cold[n:] = np.vstack([twins[k_max][rows] for k_max, rows in paired(builder)])
    n_own = np.where(np.arange(len(cold)) < n, 1.0, 1.5)
    B, start_rest, start_k, scale = noise.start_influence(
        envelopes[starts][:, points].astype(float) - cold, s, plan.k[starts], n_own, S
    )

    Q, R = np.linalg.qr(A)
    arrays = {
        "i0": i0, "noise_rms": noise_rms, "A_full": A_full, "A": A, "A_step": steps, "Q": Q, "R": R,
        "v1": modes.v[:, 0], "eigenvalue_share": modes.share, "schedule": points.astype(np.int64),
        "noise_switching": S, "noise_start": start_rest, "noise_start_k": start_k, "start_B": B, "start_scale": scale,
        "noise_sizes": np.array(sizes), "noise_spreads": noise.spreads(sets), "lf1_tuning": tuning.as_array(),
        **{f"noise_{name}": level for name, level in levels.items()},
        **{f"error_{name}": error.coefficients for name, error in known.items()},
        **({"nuisance_A": N} if len(plan.nuisance) else {}),
        **{name: getattr(lf2, name) for name in Lf2.__dataclass_fields__ if name != "i0"},
    }  # fmt: skip
    figures = {
        "noise_rms_A": float(np.sqrt(np.mean(noise_rms**2))),
        "lambda_1_share": float(modes.share[0]),
        "n_runs": float(len(plan)),
    }
    return arrays, figures
