"""What noise makes of a free run of the right model: of each output, of the drive, of the start state."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter1d

from ema.core.records import Array
from ema.discrepancy.axis.reading.pushed import LEAST_R, pushed
from ema.discrepancy.axis.reading.windows import HALF, START_NOISE, Bench, Window, speed_noise
from ema.discrepancy.verdict import average
from ema.models.axis_config import Axis

from .whitening import Filter, Push, design, open_loop_variance, variance_without_start

TURNING = 0.1  # of a sample: how well the moment is known at which friction turns round
N_DRAWN = 4  # records of noise, of each window
FIRST, FIRST_PART = 12, 4  # samples at least, and share of a window, to which its start state is fitted


@dataclass(frozen=True)
class NoiseModel:
    """Noise of one window; see `whitening.design`.

    Attributes
    ----------
    H : array, shape (n_channels, 2)
        How each output sees a deviation of position and speed.
    noise : array, shape (n_channels, n_times)
        Rms of each output's noise.
    push : Push
        Accelerations by noise: of a known load and of the moment at which friction turns round, and of the drive.
    excursion : two floats
        How far position and speed may start from the truth, generously.
    """

    H: Array
    noise: Array
    push: Push
    excursion: tuple[float, float]


def position_noise(b: Bench, w: Window) -> float:
    """Rms noise of the position, measured or integrated from the speed over one sample. [rad or m]"""
    if b.roles.position is not None:
        return b.noise[b.roles.position].sigma
    return speed_noise(b.roles, b.noise, w.period) * w.period


def whitener(p: Axis, b: Bench, w: Window) -> Filter:
    """The filter that makes a window's residual white."""
    m = noise_model(p, b, w)
    return design(m.H, m.noise, m.push, m.excursion)


def measure_bounded(p: Axis, b: Bench, w: Window, groups: Sequence[int]) -> Array:
    """Share of the variance of a window's residual, averaged over so many samples, that its outputs make.

    Of outputs without noise of their own: only a bound is known of that share, and of all where the drive has none
    either. Noise of a drive is integrated: where it is slow, it makes nearly all of a residual, however little is known
    of the outputs'.
    """
    if b.noise[b.roles.drive].is_bound:
        return np.ones(len(groups))
    of_outputs = noise_model(p, b, w).noise * np.random.default_rng(0).standard_normal((N_DRAWN, *np.shape(w.outputs)))
    made = np.concatenate([whitener(p, b, w).whiten(x) for x in of_outputs])
    return np.array([np.mean(average(made, min(g, w.n)) ** 2) for g in groups])


def noise_model(p: Axis, b: Bench, w: Window, *, turning: bool = True) -> NoiseModel:
    """Noise of a window. The moment at which friction turns round is known as well as the smoothed speed shows it.

    With `turning` not better than `TURNING` around it: a residual that is weighed by its noise must not rest on it.
    """
    kind = b.roles.kind
    k_e, R, L, J = float(p.k_e or 0.0), max(float(p.R or 0.0), LEAST_R), float(p.L or 0.0), p.inertia
    acceleration = np.gradient(w.speed, w.t)
    drive_noise = b.noise[b.roles.drive].rms(np.gradient(w.drive, w.t))  # of what is slow in it, too
    rows, noise = [], []
    for place, name in enumerate(b.roles.outputs):
        sigma = b.noise[name]
        if name in ("theta_m", "q"):
            rows.append((1.0, 0.0))
            noise.append(sigma.rms(w.speed))
        elif name in ("w_m", "v"):
            rows.append((0.0, 1.0))
            noise.append(sigma.rms(acceleration))
        elif name == "u_q":
            rows.append((0.0, k_e))
            through = np.hypot(R, L / (np.sqrt(2.0) * w.period)) * np.sqrt(w.left) * drive_noise
            noise.append(np.hypot(sigma.rms(np.gradient(w.outputs[place], w.t)), through))
        else:
            rows.append((0.0, -k_e / R if kind == "voltage" else -(p.loop.K_w if p.loop else 0.0)))
            passed = np.sqrt(np.minimum(w.left, w.period / (2.0 * L / R + w.period)))
            through = passed / R * drive_noise if kind == "voltage" else 0.0
            noise.append(np.hypot(sigma.rms(np.gradient(w.outputs[place], w.t)), through))
    gain, damping = pushed(p, kind)
    jumps = w.part.jumps[w.first : w.first + w.n]
    process, drive = np.hypot(b.load_noise / J, gain * jumps), gain * drive_noise
    speed = w.part.speed[w.first : w.first + w.n]  # smoothed no wider than it bends: a stop is at its own sample
    at_rest = np.abs(speed) < 3.0 * START_NOISE * speed_noise(b.roles, b.noise, w.period)
    held = at_rest & np.roll(at_rest, 1) & np.roll(at_rest, -1)
    process, drive = np.where(held, 0.0, process), np.where(held, 0.0, drive)
    turns = np.diff(np.where(at_rest, 0.0, np.sign(speed)), prepend=np.sign(speed[0])) != 0.0
    stops = maximum_filter1d(np.abs(acceleration), 2 * HALF + 1)  # at rest there is none: how it came there, or left
    late = START_NOISE * speed_noise(b.roles, b.noise, w.period) / np.maximum(stops, 1e-300)
    share = np.minimum(late / w.period, 1.0)  # of a sample
    if turning:
        turns |= np.roll(turns, -1) | np.roll(turns, 1)
        share = np.full(w.n, TURNING)
    process = np.where(turns, np.hypot(process, share * 2.0 * float(p.F_s or p.F_d) / J), process)
    excursion = (
        0.1 * float(np.ptp(w.position)) + 20.0 * position_noise(b, w),
        0.1 * float(np.ptp(w.speed)) + 20.0 * speed_noise(b.roles, b.noise, w.period),
    )
    push = Push(np.append(np.diff(w.t), 0.0), damping, process, drive, w.left)
    return NoiseModel(np.array(rows), np.array(noise), push, excursion)


def without_start(p: Axis, b: Bench, w: Window, r: Array) -> tuple[Array, Array]:
    """Free-run residual less what another start state makes of it, and its variance; both (n_channels, n_times).

    The start state is fitted to the window's first part.
    """
    if w.static:
        of_load = b.load_noise / float(p.k_t or 1.0)
        return r, np.full((1, w.n), b.noise[b.roles.drive].sigma ** 2 + of_load**2)
    m = noise_model(p, b, w, turning=False)
    H, damping = m.H, m.push.damping
    now = open_loop_variance(H, m.noise, m.push, np.zeros((2, 2)))
    late = w.t - w.t[0]
    fade = np.exp(-damping * late)
    reach = (1.0 - fade) / damping if damping > 0.0 else late
    modes = np.stack([H[:, :1] + 0.0 * late, H[:, :1] * reach + H[:, 1:] * fade], axis=2)  # (n_channels, n, 2)
    first = slice(0, max(FIRST, w.n // FIRST_PART))
    weight = 1.0 / now[:, first]
    A = np.einsum("cni,cn,cnj->ij", modes[:, first], weight, modes[:, first])
    known = b.roles.position is not None
    A = A if known else A + np.diag([1.0 / position_noise(b, w) ** 2, 0.0])
    estimator = np.ascontiguousarray(np.einsum("ij,cnj,cn->nic", np.linalg.inv(A), modes[:, first], weight))
    out = variance_without_start(H, m.noise, m.push, estimator, modes)
    return r - modes @ np.einsum("nic,cn->i", estimator, r[:, first]), out
