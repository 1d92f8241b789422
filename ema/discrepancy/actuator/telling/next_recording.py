"""What to record next: how far two sets of causes that fit alike are foretold apart by each of a handful of motions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ema.core.errors import RecordError
from ema.core.names import CURRENTS, FAULTS
from ema.core.records import Array, Cycle, Record
from ema.discrepancy.actuator.fitting.comparators import take_step
from ema.discrepancy.actuator.fitting.fit import columns, columns_of_all, stacked_jacobian
from ema.discrepancy.actuator.fitting.model import Model
from ema.discrepancy.actuator.reading.cycles import prepare
from ema.discrepancy.actuator.simulating.noise import Noise
from ema.discrepancy.actuator.simulating.plant import EmaPlant
from ema.models import hf

from .motions import Motion, motions

if TYPE_CHECKING:
    from ema.discrepancy.actuator.fitting.search import Search

N_CYCLES = 4  # of the motion that is recommended
N_EACH = 24  # runs of each half: two halves, so that noise of means does not look like a difference
SEED = 11_000_000
N_RUNS = 64, 32  # for the noise of each motion
RULED_OUT = 5.0  # nats behind the likeliest, from which a set needs no further recording
CLEAR = 3.0  # standard deviations that a recording must promise, and that the promise must stand out of chance
THE_SAME = "the motions of this record again"


def next_recording(
    search: Search, after: Model, alike: Sequence[tuple[str, ...]], posterior: Sequence[dict[str, Any]]
) -> dict[str, Any]:
    """For findings.json; empty where nothing is left to be told apart, or the rival was not fitted.

    Both sets are simulated under each motion, at their fitted parameters. The separation is what is left of their
    difference, in standard deviations of `N_CYCLES` cycles, once the rival has moved its parameters as far as this
    record allows: d² = min_θ (n |δ − J θ|² + |J_rec θ|²), δ and J whitened by the noise of the motion.
    """
    rival = _rival(search, after, alike, posterior)
    if rival is None:
        return {}
    search.say("what to record next")
    known = _information(search, rival)
    told = [{"motion": THE_SAME, **_separation(search.plant, search.noise, after, rival, known)}]
    for motion in motions(search.plant.plant, float(search.plant.data.commands[0][0])):
        try:
            plant = _made(search.plant, motion)
        except RecordError:  # one that this plant cannot follow
            continue
        noise = Noise(plant, after.fit.point, N_RUNS)
        told.append({"motion": motion.said, **_separation(plant, noise, after, rival, known)})
    told.sort(key=lambda row: -row["deviations"])
    return {
        "between": [list(after.names), list(rival.names)],
        "cycles": N_CYCLES,
        "motions": told,
        "sentence": _sentence(after, rival, told),
    }


def _sentence(after: Model, rival: Model, told: Sequence[dict[str, Any]]) -> str:
    one, other = (" + ".join(m.names) or "faults alone" for m in (after, rival))
    clear = [row for row in told if row["deviations"] ** 2 > CLEAR * max(CLEAR, row["deviations_by_chance"] ** 2)]
    if not clear:
        return (
            f"None of {len(told)} motions tried would tell {one} from {other} in {N_CYCLES} cycles: at most "
            f"{told[0]['deviations']:.1f} standard deviations, of which chance makes up to "
            f"{told[0]['deviations_by_chance']:.1f}"
        )
    best = clear[0]
    again = next((row for row in told if row["motion"] == THE_SAME and row is not best), None)
    text = (
        f"To tell {one} from {other}, record {N_CYCLES} cycles of {best['motion']}: {best['deviations']:.0f} standard "
        f"deviations apart, most of them in the balance “{best['shows_in']}”"
    )
    return text if again is None else f"{text}; {THE_SAME}: {again['deviations']:.1f}"


def _rival(
    search: Search, after: Model, alike: Sequence[tuple[str, ...]], posterior: Sequence[dict[str, Any]]
) -> Model | None:
    """The best fit of what the answer is not told from: another effect in place of one, or the posterior's next."""
    sets = [{*after.names[:j], rival, *after.names[j + 1 :]} for j, rivals in enumerate(alike) for rival in rivals]
    sets += [set(row["effects"]) for row in posterior if row["nats_behind"] < RULED_OUT]
    for names in sets:
        effects = names - set(FAULTS)
        of = [m for m in search.tried if set(m.names) == effects and effects != set(after.names)]
        if of:
            return min(of, key=lambda m: m.heldout)
    return None


def _information(search: Search, model: Model) -> Array:
    """What this record knows of the rival's parameters, JᵀJ."""
    cols = columns_of_all(search.plant, model.fit)
    J = stacked_jacobian(search.noise, model.fit.free, cols, range(search.plant.data.n_cycles))
    return np.asarray(J.T @ J)


def _separation(plant: EmaPlant, noise: Noise, one: Model, other: Model, known: Array) -> dict[str, Any]:
    """Deviations between two models in `N_CYCLES` cycles of a plant's motions in turn, and where they show most."""
    cycles, frees = plant.first, other.fit.free
    points = [one.fit.point, other.fit.point]
    halves = [plant.means(points, cycles, N_EACH, SEED + 500 * half) for half in (0, 1)]
    motions = range(plant.n_motions)
    J = stacked_jacobian(noise, frees, columns(plant, frees, other.fit.point, motions), cycles)
    n = N_CYCLES / len(cycles)
    first, second = (np.concatenate([noise.of(c).white(a[c] - b[c]) for c in cycles]) for a, b in halves)
    hidden = n * J @ np.linalg.pinv(known + n * J.T @ J) @ J.T
    squared = n * float(first @ second - first @ hidden @ second)
    parts: dict[str, float] = {}
    begin = 0
    for c in cycles:
        for name, at in plant.slices[int(plant.data.motion[c])].items():
            here = slice(begin + at.start, begin + at.stop)
            parts[name] = parts.get(name, 0.0) + float(first[here] @ (second - hidden @ second)[here])
        begin += len(plant.data.y[c])
    chance = n * np.sqrt(len(first)) * 2.0 / N_EACH  # standard deviation of `squared` where nothing differs
    return {
        "deviations": float(np.sqrt(max(squared, 0.0))),
        "deviations_by_chance": float(np.sqrt(chance)),
        "shows_in": max(parts, key=lambda name: parts[name]),
    }


def _made(plant: EmaPlant, motion: Motion) -> EmaPlant:
    """The plant with one cycle of a motion, as if it had been recorded there."""
    old = plant.data
    first = motion.command[:1]
    start = hf.start_at(plant.plant, first, plant.plant.transmission.GR * first, first)
    r = hf.simulate(plant.plant, np.zeros(6), motion.command, seeds=SEED, start=start)
    channels = {
        "t": np.arange(len(motion.command)) / plant.plant.control.rate,
        **{name: r.i[0, j] for j, name in enumerate(CURRENTS)},
        "theta_m": r.theta_m[0], "theta_u": r.theta_u[0], "theta_cmd": motion.command,
    }  # fmt: skip
    if old.signals[0].u_dc is not None:
        channels["u_dc"] = r.u_dc[0]
    made = EmaPlant(plant.plant, prepare(plant.plant, [Record((Cycle(0, channels),))]), plant.n_threads)
    take_step(made, plant.step)
    return made
