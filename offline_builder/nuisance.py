"""Nuisance parameters of a bundle: from their names in the configuration to bounds, prior and scale."""

from __future__ import annotations

import numpy as np

from ema.core.errors import ConfigError
from ema.effects import registry
from ema.faults import N_FAULTS
from ema.identification.nuisance import NONE, Nuisance
from ema.models import hf
from ema.models.actuator import Actuator

from .config import Builder, NuisanceParameter

FAULT_STEP = 0.1
SHARE = 0.25  # of the way to a bound, for the step that scales a parameter
N_SEEDS = 16
SEED = 20260401
NORMAL_95 = 3.92  # width of an interval of 95 % in standard deviations


def resolve(builder: Builder, plant: Actuator) -> Nuisance:
    """The nuisance parameters with all their numbers; ConfigError where one has no meaning for this plant."""
    entries = [_checked(one, plant) for one in builder.nuisance]
    if len({e["parameter"] for e in entries}) < len(entries):
        raise ConfigError("key 'nuisance': a parameter is named twice")
    if not entries:
        return NONE
    return scaled(Nuisance.of(entries), plant)


def _checked(one: NuisanceParameter, plant: Actuator) -> dict[str, object]:
    where = f"key 'nuisance': {one.parameter}"
    effect, name = one.parameter.split(".")
    known = registry()
    if effect not in known or "ema" not in known[effect].plants:
        names = ", ".join(e for e, found in known.items() if "ema" in found.plants)
        raise ConfigError(f"{where}: no effect '{effect}'; known: {names}")
    if known[effect].is_table:
        raise ConfigError(f"{where}: is one value of a table, and cannot be estimated alone")
    parameters = {p.name: p for p in known[effect].parameters}
    if name not in parameters:
        raise ConfigError(f"{where}: the effect has no parameter '{name}'; it has: {', '.join(parameters)}")
    p = parameters[name]
    centre = plant.effects.get(effect, {}).get(name, p.neutral)
    low, high = (p.low if one.low is None else one.low), (p.high if one.high is None else one.high)
    if not p.low <= low < high <= p.high or not low <= centre <= high:
        raise ConfigError(
            f"{where}: bounds {low:g} … {high:g} must lie within {p.low:g} … {p.high:g} {p.unit} and hold the plant's "
            f"value {centre:g}"
        )
    sd = one.sd
    if sd == "interval":
        interval = plant.intervals.get(effect, {}).get(name)
        if interval is None:
            raise ConfigError(f"{where}: sd = interval, but the plant file gives no interval of it; give a number")
        sd = max((interval[1] - interval[0]) / NORMAL_95, 1e-9)
    elif sd is None:
        sd = (high - low) / np.sqrt(12.0)
    if not sd > 0:
        raise ConfigError(f"{where}: sd = {sd:g} must be above 0")
    return {"parameter": one.parameter, "unit": p.unit, "centre": centre, "scale": 1.0, "low": low, "high": high,
            "sd": sd}  # fmt: skip


def scaled(nuisance: Nuisance, plant: Actuator) -> Nuisance:
    """The same with scales: a unit of ν changes the envelope as much as a unit of a fault does on average."""
    reach = np.where(
        nuisance.high - nuisance.centre >= nuisance.centre - nuisance.low,
        nuisance.high - nuisance.centre,
        nuisance.low - nuisance.centre,
    )
    points = np.zeros((1 + N_FAULTS + len(nuisance), N_FAULTS + len(nuisance)))
    points[1 : 1 + N_FAULTS, :N_FAULTS] = FAULT_STEP * np.eye(N_FAULTS)
    points[1 + N_FAULTS :, N_FAULTS:] = np.diag(SHARE * reach)
    x = np.repeat(points, N_SEEDS, axis=0)
    runs = hf.simulate(
        plant, x[:, :N_FAULTS], seeds=SEED + np.arange(len(x)), effects=nuisance.effects(x, plant.effects)
    )
    mean = runs.envelope.reshape(len(points), N_SEEDS, -1).mean(axis=1)
    moved = np.linalg.norm(mean[1:] - mean[0], axis=1)
    per_fault = np.sqrt(np.mean((moved[:N_FAULTS] / FAULT_STEP) ** 2))
    entries = nuisance.as_list()
    for entry, distance, step in zip(entries, moved[N_FAULTS:], np.abs(SHARE * reach), strict=True):
        # a parameter that hardly shows keeps a scale within its bounds: its prior then stays what it was
        entry["scale"] = float(min(per_fault * step / max(distance, 1e-12), entry["high"] - entry["low"]))
    return Nuisance.of(entries)
