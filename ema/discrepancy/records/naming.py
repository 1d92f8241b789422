"""What a stranger's columns probably are: a proposal to be read by its owner, never a reading of the file by itself."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

from ema.core.names import CHANNELS
from ema.core.table import Table
from ema.core.table_records import titled
from ema.core.text_table import UNTITLED
from ema.core.units import convert

from .shown import Shown

_COMMAND = {
    "ref", "reference", "cmd", "command", "commanded", "target", "goal", "desired", "des", "set", "setpoint", "demand",
    "soll",
}  # fmt: skip
_MEASURED = {"present", "actual", "act", "measured", "meas", "ist"}
_SUPPLY = {"dc", "bus", "supply", "vbus", "udc", "vdc", "battery", "batt", "bat", "vbat", "vbatt", "vsupply"}
_LOAD = {"load", "external", "ext", "airload", "resisting", "brake", "last", "lastmoment"}
_OUTPUT = {"user", "output", "load", "lvdt", "surface", "ram"}
_PHASE = {"a": "i_a", "b": "i_b", "c": "i_c", "u": "i_a", "v": "i_b", "w": "i_c"}
_PHASES = re.compile(r"(?:i|cur|current|phase|iphase|i ?phase)[ _]*([abcuvw])$")
_DRIVES = ("current", "force", "torque", "duty")
_BY_LOAD = {"force": "load_force", "torque": "load_torque"}
_SHARES = {"%", "percent", "pct", "per cent"}
_WRITTEN = {  # as a proposal; a file's own is not read so
    "u/min": "rpm", "1/min": "rpm", "min-1": "rpm", "grad": "deg", "dps": "deg/s", "rps": "turn/s",
    "c": "°C", "degc": "°C",
}  # fmt: skip
_COUNTS = {"count", "counts", "ticks", "cnt", "cnts", "inc", "increments", "lsb"}
# What is measured, by its unit where the file gives one, else by the words of the title.
_UNITS = {
    "time": "s", "angle": "rad", "length": "m", "turning": "rad/s", "speed": "m/s", "current": "A", "voltage": "V",
    "force": "N", "torque": "N m", "temperature": "°C",
}  # fmt: skip
_WORDS = {
    "time": "t time timestamp zeit sec secs seconds stamp",
    "length": "displacement stroke travel",
    "angle": "pos position angle theta phi q encoder enc th joint shaft winkel weg",
    "turning": "vel velocity speed omega w dq qd rpm rate geschwindigkeit drehzahl",
    "current": "current cur i iq amps amp strom",
    "voltage": "voltage volt volts u uq spannung",
    "force": "force kraft f",
    "torque": "torque tau moment effort trq drehmoment",
    "duty": "duty pwm dutycycle throttle",
    "temperature": "temperature temp temperatur",
    "enabled": "enabled enable active freigabe",
}


@dataclass(frozen=True)
class Proposal:
    """What one column may be: `channel` None where nothing fits, `said` tells why, or what to look at."""

    title: str
    channel: str | None
    unit: str | None
    said: str


def propose(table: Table) -> list[Proposal]:
    """One proposal for each column of the file; each channel is proposed once, the first column that fits.

    What was commanded is proposed for a drive only where nothing that was measured is.
    """
    if table.header[0] == f"{UNTITLED}1":
        return _propose_untitled(table)
    seen = [_quantity(title, table.units.get(index)) for index, title in enumerate(table.header)]
    measured = {what for what, _ in seen}
    is_linear = bool(measured & {"length", "speed"} or ("force" in measured and not measured & {"angle", "turning"}))
    is_actuator = sum(_PHASES.search(_plain(title)) is not None for title in table.header) >= 2
    has_duty = "duty" in measured
    has_drive = any(
        what in ("current", "voltage", "duty") or (what in _BY_LOAD and not _is_of_load(title))
        for title, (what, _) in zip(table.header, seen, strict=True)
    )
    shown = Shown(table)
    currents = [k for k, (what, _) in enumerate(seen) if what == "current"]
    reversing = currents + [k for k, (what, _) in enumerate(seen) if what in ("turning", "speed")]
    taken: dict[str, str] = {}
    found: dict[int, Proposal] = {}
    for index in sorted(range(len(seen)), key=lambda k: _is_commanded_drive(table.header[k], seen[k][0])):
        title, (what, unit) = table.header[index], seen[index]
        channel = _channel(title, what, is_linear and unit is None, is_actuator, has_duty)
        if has_drive and what in _BY_LOAD and _is_of_load(title):
            channel = _BY_LOAD[what]  # what the drive works against
        if channel == "u_q" and shown.feeds(index, reversing):
            channel = "u_dc"
        why = _why_not(table, index, what, channel, is_linear) or _shown_not(table, shown, index, what, currents)
        if channel is None or why is not None:
            found[index] = Proposal(
                title, None, None, why or "no channel of an axis or an actuator by its title and unit"
            )
        elif channel in taken:
            said = f"looks like {channel} too, as '{taken[channel]}' does"
            if channel == "theta_m":
                said += f"; of a neighbouring axis it would be {{channel: theta_n, unit: {unit or 'rad'}}}"
            found[index] = Proposal(title, None, None, said)
        else:
            taken[channel] = title
            said = CHANNELS[channel].meaning
            if _is_commanded_drive(title, what):
                said += "; commanded, and taken for what acts since no measured one is there"
            if unit is None and CHANNELS[channel].unit != "1":
                own = _own_unit(title) or table.units.get(index)
                unread = f"[{own}] is no unit that is known" if own else "the file gives no unit"
                said += f"; {unread}: is it {CHANNELS[channel].unit}?"
            found[index] = Proposal(title, channel, unit or CHANNELS[channel].unit, said)
    both = {"torque", "i_q"} <= taken.keys()
    return [_ask_whose(found[index]) if both else found[index] for index in range(len(seen))]


def _propose_untitled(table: Table) -> list[Proposal]:
    """Time, where one of the columns rises; of all others what its owner needs to know it by."""
    shown = Shown(table)
    time = next((k for k in range(len(table.header)) if shown.rises(k)), None)
    return [
        Proposal(title, "t", "s", f"rises from row to row, {shown.ends(k)}: is it time in s?")
        if k == time
        else Proposal(title, None, None, f"the file has no titles; {shown.ends(k)}: {{channel: …, unit: …}}")
        for k, title in enumerate(table.header)
    ]


def _why_not(table: Table, index: int, what: str | None, channel: str | None, is_linear: bool) -> str | None:
    """Why a column is no channel as it is, and what to write instead; None where it may be one."""
    if what == "force" and not is_linear:
        lead = "{channel: load_torque, unit: N m, scale: 7.96e-4} where a screw leads by 5 mm"
        return f"a force on a rotary axis; of a load it would be {lead}"
    return None if channel is None else _of_its_own_scale(table.header[index], table.units.get(index), channel)


def _shown_not(table: Table, shown: Shown, index: int, what: str | None, currents: list[int]) -> str | None:
    """What its numbers show a column to be instead of what drives; None where they show nothing."""
    if what in _DRIVES and shown.is_zero(index):
        return "zero in all rows: it drives nothing"
    if what in _BY_LOAD and (of := shown.ratio(index, currents)) is not None:
        return f"{of[1]:.4g} times '{table.header[of[0]]}': computed from it, no measurement"
    return None


def _ask_whose(proposal: Proposal) -> Proposal:
    """What to look at where a torque stands beside a drive's current."""
    if proposal.channel != "torque":
        return proposal
    return replace(proposal, said=f"{proposal.said}: the drive's? What it works against would be load_torque")


def _plain(title: str) -> str:
    """The title without its unit, in small letters, words apart: ``MotorPos_ref [deg]`` is ``motor pos ref``."""
    name = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", titled(title)[0])
    return re.sub(r"[^a-z0-9]+", " ", name.lower()).strip()


def _is_of_load(title: str) -> bool:
    return bool(set(_plain(title).split()) & _LOAD)


def _is_commanded_drive(title: str, what: str | None) -> bool:
    return what in _DRIVES and bool(set(_plain(title).split()) & _COMMAND)


def _of_its_own_scale(title: str, apart: str | None, channel: str) -> str | None:
    """What to write for a column in counts, or in per cent of a rating, which only its owner knows; None for others."""
    unit = _own_unit(title) or apart
    last = (unit or titled(title)[0].split(" ")[-1].split("_")[-1]).strip().lower()
    if last in _COUNTS:
        return f"counts of an encoder: {{channel: {channel}, unit: turn, scale: 2.44140625e-4}} where 4096 are a turn"
    its = CHANNELS[channel].unit
    if last in _SHARES and its != "1":
        return f"per cent of a rating: {{channel: {channel}, unit: {its}, scale: 0.025}} where 100 % are 2.5 {its}"
    return None


def _own_unit(title: str) -> str | None:
    """The unit in a title, which may be nothing but that: ``[turns/s]``."""
    only = re.fullmatch(r"\s*[\[(](.+)[\])]\s*", title)
    return only[1].strip() if only else titled(title)[1]


def _written(unit: str | None) -> str | None:
    return None if unit is None else _WRITTEN.get(unit.lower().replace(" ", ""), unit)


def _quantity(title: str, apart: str | None) -> tuple[str | None, str | None]:
    """What is measured and its unit, None where not known; a unit of the file counts more than a word."""
    unit = _written(_own_unit(title) or apart)
    if unit is not None:
        for what, target in _UNITS.items():
            if _converts(unit, target):
                return what, unit
    words = _plain(title).split()
    if "rpm" in words:
        return "turning", "rpm"
    if set(words) & (_COMMAND | _MEASURED) and (ending := _ending(title, "")) is not None:
        return next((what for what, target in _UNITS.items() if _converts(ending, target)), None), ending
    for what, known in _WORDS.items():
        if set(words) & set(known.split()):
            if what == "duty":
                return what, "%" if unit in _SHARES or words[-1] in _SHARES else None
            if (ending := _ending(title, what)) is None:
                return what, None
            # a position may be of an angle or of a length, and so its speed: its unit says
            return next(((w, ending) for w, target in _UNITS.items() if _converts(ending, target)), (what, None))
    if set(words) & _SUPPLY and _ending(title, "voltage"):
        return "voltage", _ending(title, "voltage")
    return ("current", None) if _PHASES.search(_plain(title)) else (None, None)


def _ending(title: str, what: str) -> str | None:
    """The unit in the last part of a title such as ``pos_deg`` or ``torque Nm``, None where it is none."""
    parts = re.split(r"[_ ]+", titled(title)[0].strip())
    if len(parts) > 2 and any(_converts("/".join(parts[-2:]), _UNITS[rate]) for rate in ("turning", "speed")):
        return "/".join(parts[-2:])  # joint_vel_deg_s
    its = _UNITS.get(what, "")  # a single letter is a phase more often than a unit, but for what it is the unit of
    last = _written(parts[-1]) or ""
    long = len(parts[-1]) > 1 or (bool(its) and _converts(last, its))
    known = len(parts) > 1 and long and any(_converts(last, unit) for unit in _UNITS.values())
    return last if known else None


def _converts(unit: str, target: str) -> bool:
    try:
        convert(unit, target)
    except ValueError:
        return False
    return True


def _channel(title: str, what: str | None, is_linear: bool, is_actuator: bool, has_duty: bool) -> str | None:
    """The channel; `is_linear`: a position or speed without a unit is of a linear axis, since others are.

    `has_duty`: a voltage beside a duty cycle is that of the supply, of which it is a share.
    """
    words = set(_plain(title).split())
    is_command = bool(words & _COMMAND)
    is_linear = is_linear or what in ("length", "speed", "force")
    if what in ("angle", "length"):
        if is_actuator:
            return "theta_cmd" if is_command else "theta_u" if words & _OUTPUT else "theta_m"
        if is_command:
            return "q_ref" if is_linear else "theta_ref"
        return "q" if is_linear else "theta_m"
    if what in ("turning", "speed"):
        if is_command:
            return None if is_linear else "w_ref"
        return "v" if is_linear else "w_m"
    if what == "voltage":
        return "u_dc" if words & _SUPPLY or has_duty else "u_q"
    if words & _SUPPLY:  # its current is not the motor's
        return None
    if what == "current" and (phase := _PHASES.search(_plain(title))) and is_actuator:
        return _PHASE[phase[1]]
    simple = {
        "time": "t", "current": "i_q", "force": "force", "torque": "torque", "duty": "duty", "temperature": "temp_w",
        "enabled": "enabled",
    }  # fmt: skip
    return None if is_command and what not in _DRIVES else simple.get(what or "")
