"""The first plant file of a record: what a data sheet says, what the record shows, what is only a guess; each marked.

What acts is k_t i_q, a measured torque or force, k_t (u - k_e ω) / R by a voltage or a duty cycle of the supply, or
k_t K_w (ω_ref - ω) of a speed loop.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from ema.core.errors import RecordError
from ema.core.names import CHANNELS, CURRENTS
from ema.core.records import Array, Cycle, Record
from ema.discrepancy.axis.reading.channels import LOAD_CHANNEL, LOOP_CHANNELS, known_load

from .agreements import agreements, derivative, smooth
from .first_fit import FirstFit, first_fit

POLE_PAIRS = range(1, 31)
KINDS = {"i_q": "current", "u_q": "voltage", "duty": "voltage", "w_ref": "speed-loop"}  # of drive; others by their name
COHERENT = 0.5  # share of the currents' vector that turns with the rotor, from which pole pairs can be told


@dataclass(frozen=True)
class Known:
    """A parameter of the plant file: its value as text with unit, and where it is from."""

    key: str
    value: str
    origin: str


@dataclass(frozen=True)
class Sheet:
    """What a data sheet says; None where it does not. Units: rpm/V, ohm (phase), H (phase), kg m², N m/A, V.

    A `brushed` motor has the back-EMF constant of its torque; of three phases it is that of one. `drive` is the
    channel that drives, where several may, or its kind. `K_w` is the gain of a speed loop. [A s/rad] `torque_at` and
    `measured_at` are sides of the gear: of a torque sensor, and of position and speed.
    """

    pole_pairs: int | None = None
    slots: int | None = None
    gear: float | None = None
    R: float | None = None
    L: float | None = None
    KV: float | None = None
    k_t: float | None = None
    J: float | None = None
    V_dc: float | None = None
    K_w: float | None = None
    brushed: bool = False
    drive: str | None = None
    torque_at: str | None = None
    measured_at: str | None = None

    @property
    def torque_ratio(self) -> float:
        """A measured torque as it acts on the measured side, over what was recorded."""
        at = (self.torque_at or "motor", self.measured_at or "motor")
        gear = self.gear or 1.0
        return {("load", "motor"): 1.0 / gear, ("motor", "load"): gear}.get(at, 1.0)

    @property
    def load_ratio(self) -> float:
        """A known load as it acts on the measured side, over what was recorded on the user's."""
        return 1.0 / self.gear if self.gear is not None and self.measured_at != "load" else 1.0


def motion_channels(have: Collection[str]) -> tuple[str, str]:
    """Position and speed of the axis that these channels are of: a linear one where there is nothing that turns."""
    turns, slides = ("theta_m", "w_m"), ("q", "v")
    return slides if not any(x in have for x in turns) and any(x in have for x in slides) else turns


def begin_axis(records: Sequence[Record], sheet: Sheet) -> list[Known]:
    """Parameters of an axis from its records; RecordError where they hold no motion or no drive."""
    have = set.intersection(*(set(record.channels) for record in records))
    there = ", ".join(sorted(have))
    position, speed = motion_channels(have)
    linear = position == "q"
    if not have & {position, speed}:
        raise RecordError(f"{records[0].name}: no motion: theta_m, w_m, q or v is wanted (has {there})")
    measured = "force" if linear else "torque"
    drives = [name for name in (measured, "i_q", "u_q", "duty", *(() if linear else ("w_ref",))) if name in have]
    asked = [name for name in drives if sheet.drive in (None, name, KINDS.get(name))]
    if sheet.drive is not None and not asked:
        raise RecordError(f"{records[0].name}: {sheet.drive} cannot drive: {' or '.join(drives) or 'nothing'} may")
    drive = next(iter(asked), None)
    if drive is None:
        said = f"{records[0].name}: no drive: {measured}, i_q, u_q, duty or w_ref is wanted (has {there})"
        _, reference = LOOP_CHANNELS[linear]
        if reference in have:
            said += f"; a position_loop that makes it from {reference} is written by hand, see docs/axis.md"
        raise RecordError(said)
    known = [Known("kind", "axis", "")] + ([Known("motion", "linear", "")] if linear else [])
    kind = KINDS.get(drive, drive)
    others = " or ".join(name for name in drives if name != drive)
    known.append(Known("drive", kind, f"by the channel {drive}{f'; {others} by --drive' if others else ''}"))
    k_t, k_e, whence = _constants(sheet)
    if kind in KINDS.values():
        known += [Known("k_t", _number(k_t, "N/A" if linear else "N m/A"), whence)]
    if kind == "voltage" or "u_q" in have:
        known += [Known("k_e", _number(k_e, "V s/m" if linear else "V s/rad"), f"{whence}{_of_phase(sheet)}")]
    for key, unit, value in (("R", "ohm", sheet.R), ("L", "H", sheet.L), ("V_dc", "V", sheet.V_dc)):
        if value is not None:
            known.append(Known(key, _number(value, unit), "data sheet"))
        elif key == "R" and kind == "voltage":
            known.append(Known(key, "1 ohm", "a guess: give --R"))
        elif key == "V_dc" and drive == "duty" and "u_dc" not in have:
            known.append(Known(key, "24 V", "a guess: give --supply"))
    if kind == "speed-loop":
        gain, whence = (1.0, "a guess: give --K-w") if sheet.K_w is None else (sheet.K_w, "data sheet")
        known.append(
            Known("loop", f"{{K_w: {_number(gain, 'A s/rad')}}}", f"{whence}; its limit: {{K_w: …, I_max: …}}")
        )
    if "theta_n" in have:
        known.append(Known("neighbour", "inner", "a guess: outer where theta_n is of the link that hangs on this one"))
    fit = first_fit(records, position, speed, _torques(records, drive, position, speed, sheet, k_t, k_e))
    untold = _untold(sheet, drive, supply_recorded="u_dc" in have)
    return [*known, *_mechanical(fit, sheet, drive, untold, linear=linear)]


def _untold(sheet: Sheet, drive: str, *, supply_recorded: bool) -> str:
    """The options without which the torque is not known, where one is wanted."""
    wanted = {
        "--supply": drive == "duty" and sheet.V_dc is None and not supply_recorded,
        "--R": drive in ("u_q", "duty") and sheet.R is None,
        "--K-w": drive == "w_ref" and sheet.K_w is None,
    }
    return " and ".join(option for option, is_wanted in wanted.items() if is_wanted)


def _gear(sheet: Sheet, drive: str) -> list[Known]:
    """The gear, and on which side of it things were measured: often a torque is at the load."""
    sides = {"measured_at": ("position, speed and inertia", sheet.measured_at)}
    if drive == "torque":
        sides["torque_at"] = ("the torque", sheet.torque_at)
    known = [Known("gear", f"{sheet.gear:g}", "data sheet")]
    for key, (what, said) in sides.items():
        asked = f"a guess: give --{key.replace('_', '-')} load for {what} behind the gear"
        known.append(Known(key, said or "motor", "as you said" if said else asked))
    return known


def _mechanical(fit: FirstFit, sheet: Sheet, drive: str, untold: str, *, linear: bool) -> list[Known]:
    """Inertia, drag and friction, each with where it is from."""
    mass, unit = ("M", "kg") if linear else ("J", "kg m^2")
    beside = f", beside a torque of order {', '.join(f'{n:g}' for n in fit.orders)}" if fit.orders else ""
    fitted = f"fitted to the records, a start{beside}"
    guess = f"a guess: the records may show it with {untold}" if untold else "a guess: the records do not show it"
    known = []
    for key, its, value, otherwise, given in (
        (mass, unit, fit.inertia, 1e-4, sheet.J),
        ("C", "N s/m" if linear else "N m s/rad", fit.drag, 0.0, None),
        ("F_d", "N" if linear else "N m", fit.friction, 1e-3, None),
    ):
        origin = "data sheet" if given is not None else fitted if value is not None else guess
        known.append(Known(key, _number(next(x for x in (given, value, otherwise) if x is not None), its), origin))
    known += [] if sheet.gear is None else _gear(sheet, drive)
    for key, number in (("p", sheet.pole_pairs), ("slots", sheet.slots)):
        if number and not linear:
            known.append(Known(key, str(number), "data sheet"))
    free = [mass] * (sheet.J is None) + ["C"] * (fit.drag is not None)  # a start is no number to hold on to
    known.append(
        Known("fitted", f"[{', '.join(free)}]", "fitted in every model: no finding is of these; take out what you know")
    )
    return known


def pole_pairs(record: Record) -> int | None:
    """Pole pairs by which the phase currents turn with the rotor; None where they do not tell."""
    if not {*CURRENTS, "theta_m"} <= set(record.channels):
        return None
    turn = np.exp(2j * np.pi / 3.0 * np.arange(3))
    s = np.concatenate([turn @ np.stack([cycle[name] for name in CURRENTS]) for cycle in record.cycles])
    theta_m = np.concatenate([cycle["theta_m"] for cycle in record.cycles])
    # The square does not know the torque's sign.
    share = [abs(np.sum(s**2 * np.exp(-2j * p * theta_m))) / max(np.sum(np.abs(s) ** 2), 1e-300) for p in POLE_PAIRS]
    best = int(np.argmax(share))
    return POLE_PAIRS[best] if share[best] > COHERENT else None


def gear_ratio(record: Record) -> float | None:
    """Turns of the motor for one of the user; None where there is no such pair of channels."""
    return next((one.slope for one in agreements(record) if one.what == "theta_m against theta_u"), None)


def back_emf(KV: float) -> float:
    """k_e of one phase [V s/rad] from KV [rpm/V], which is of the line-to-line voltage."""
    return float(60.0 / (2.0 * np.pi * KV * np.sqrt(3.0)))


def _constants(sheet: Sheet) -> tuple[float, float, str]:
    """k_t, k_e on the side of the gear where position and speed are, and where they are from."""
    k_t, k_e, whence = _of_motor(sheet)
    if sheet.measured_at != "load" or sheet.gear is None or (sheet.k_t is None and sheet.KV is None):
        return k_t, k_e, whence
    return sheet.gear * k_t, sheet.gear * k_e, f"{whence}, times the gear: at the load"


def _of_motor(sheet: Sheet) -> tuple[float, float, str]:
    """Of the motor itself: KV is of the line-to-line voltage, currents are amplitude-invariant."""
    if sheet.k_t is not None:
        return sheet.k_t, sheet.k_t if sheet.brushed else sheet.k_t / 1.5, "data sheet"
    if sheet.KV is not None and sheet.brushed:
        k_e = 60.0 / (2.0 * np.pi * sheet.KV)
        return k_e, k_e, f"KV {sheet.KV:g} rpm/V: k_e = k_t = 60 / (2 pi KV)"
    if sheet.KV is not None:
        k_e = back_emf(sheet.KV)
        return 1.5 * k_e, k_e, f"KV {sheet.KV:g} rpm/V: k_e = 60 / (2 pi KV sqrt 3), k_t = 3/2 k_e"
    return 1.0, 1.0, "a guess: give --kv or --k-t; until then inertia and friction are in units of the current"


def _of_phase(sheet: Sheet) -> str:
    return "; that of k_t" if sheet.brushed else "; k_t / 1.5 as of three phases: give --brushed if it is none"


def _torques(
    records: Sequence[Record], drive: str, position: str, speed: str, sheet: Sheet, k_t: float, k_e: float
) -> list[list[Array]]:
    """The drive's torque less a known load, by record and cycle; zeros for what a voltage does not tell of it."""
    load = LOAD_CHANNEL[position == "q"]

    def moving(cycle: Cycle) -> Array:
        return smooth(cycle[speed]) if speed in cycle else derivative(cycle, position)

    def of(cycle: Cycle) -> Array:
        if drive == "w_ref":
            return np.asarray(k_t * (sheet.K_w or 0.0) * (cycle[drive] - moving(cycle)))
        if drive not in ("u_q", "duty"):
            return cycle[drive] * {"i_q": k_t, "torque": sheet.torque_ratio}.get(drive, 1.0)
        supply = 1.0 if drive == "u_q" else cycle.channels.get("u_dc", sheet.V_dc)
        if sheet.R is None or supply is None:
            return np.zeros(cycle.n_samples)
        u = cycle[drive] * supply
        return np.asarray(k_t * (u - k_e * moving(cycle)) / sheet.R)

    return [[of(cycle) - sheet.load_ratio * known_load(cycle, load) for cycle in record] for record in records]


def _number(value: float, unit: str) -> str:
    return f"{value:.4g} {unit}"


def describe_channels(records: Sequence[Record]) -> str:
    """Channels of the records with their units, for a comment."""
    names = sorted(set.union(*(set(record.channels) for record in records)))
    return ", ".join(f"{name} [{CHANNELS[name].unit}]" for name in names)
