"""What daemon and worker process say to each other over a Unix socket: one line of JSON for a job, one for its answer.

Floats go through JSON without losing a bit; NaN is null. Of an estimate stays behind what only its intervals are made
from (`marginals`, `edges`): the monitor asks for none.
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from ema.bundle import Bundle
from ema.core.config import digest
from ema.core.status import Reason, Status
from ema.identification import Estimate, Measurement, NuisanceEstimate
from ema.monitor import Job

MAX_LINE = 1 << 20  # [B]
_ARRAYS = ("k", "sd", "covariance", "residual")
_NUMBERS = ("chi2", "p_value")
_NUISANCE = ("value", "sd", "covariance", "interval95")  # arrays of a NuisanceEstimate


class WireError(Exception):
    """The other side is not there, does not answer, or says what makes no sense."""


def fingerprint(bundle: Bundle) -> str:
    """What both sides must agree on: plant and contents of the bundle."""
    arrays = bundle.manifest["arrays"]
    return digest(bundle.plant) + "".join(arrays[name]["sha256"][:8] for name in sorted(arrays))


def pack_job(job: Job, bundle: Bundle) -> bytes:
    """A job as a line."""
    m = job.measurement
    return _line(
        {
            "bundle": fingerprint(bundle),
            "method": job.method,
            "actuator": job.actuator,
            "cycle": job.cycle,
            "t_ns": job.t_ns,
            "i_hat": _plain(m.i_hat),
            "start": None if m.start is None else _plain(m.start),
            "valid": m.valid.tolist(),
        }
    )


def unpack_job(line: bytes) -> tuple[Job, str]:
    """A job and the fingerprint of its bundle; WireError when the line makes no sense."""
    said = _read(line)
    try:
        start = said["start"]
        measurement = Measurement(
            _array(said["i_hat"]), None if start is None else _array(start), np.array(said["valid"], bool)
        )
        if measurement.i_hat.ndim != 1 or measurement.i_hat.shape != measurement.valid.shape:
            raise ValueError("shapes")
        job = Job(said["t_ns"], said["actuator"], said["cycle"], said["method"], measurement, Reason(0))
        return job, str(said["bundle"])
    except (KeyError, TypeError, ValueError) as error:
        raise WireError("a job makes no sense") from error


def pack_answer(answer: Estimate | Exception) -> bytes:
    """An estimate, or why there is none, as a line."""
    if isinstance(answer, Exception):
        return _line({"error": " ".join(str(answer).split()) or repr(answer)})
    content = {name: _plain(getattr(answer, name)) for name in _ARRAYS}
    content |= {name: None if np.isnan(x := getattr(answer, name)) else float(x) for name in _NUMBERS}
    content["unseparable"] = [_plain(direction) for direction in answer.unseparable]
    codes = {"dof": int(answer.dof), "status": int(answer.status), "reasons": int(answer.reasons)}
    return _line({"method": answer.method, **content, **codes, "nuisance": _pack_nuisance(answer.nuisance)})


def _pack_nuisance(beside: NuisanceEstimate | None) -> dict[str, Any] | None:
    if beside is None:
        return None
    numbers = {name: _plain(getattr(beside, name)) for name in _NUISANCE}
    return {"names": list(beside.names), "units": list(beside.units), **numbers}


def _unpack_nuisance(said: dict[str, Any] | None) -> NuisanceEstimate | None:
    if said is None:
        return None
    return NuisanceEstimate(tuple(said["names"]), tuple(said["units"]), *(_array(said[name]) for name in _NUISANCE))


def unpack_answer(line: bytes) -> Estimate:
    """The estimate; WireError when there is none or the line makes no sense."""
    said = _read(line)
    if "error" in said:
        raise WireError(str(said["error"]))
    try:
        k, sd, covariance, residual = (_array(said[name]) for name in _ARRAYS)
        chi2, p_value = (float(_array(said[name])) for name in _NUMBERS)
        status, reasons = Status(said["status"]), Reason(said["reasons"])
        return Estimate(
            *(str(said["method"]), k, sd, covariance, chi2, int(said["dof"]), p_value, residual, status, reasons),
            unseparable=tuple(_array(direction) for direction in said["unseparable"]),
            nuisance=_unpack_nuisance(said["nuisance"]),
        )
    except (KeyError, TypeError, ValueError) as error:
        raise WireError("an answer makes no sense") from error


def _line(content: dict[str, Any]) -> bytes:
    return json.dumps(content, allow_nan=False).encode() + b"\n"


def _read(line: bytes) -> dict[str, Any]:
    try:
        said = json.loads(line)
    except (ValueError, RecursionError) as error:
        raise WireError("not JSON") from error
    if not isinstance(said, dict):
        raise WireError("not a JSON object")
    return said


def _plain(x: np.ndarray) -> Any:
    plain = x.astype(object)
    plain[np.isnan(x)] = None
    return plain.tolist()


def _array(values: Any) -> np.ndarray:
    return np.array(values, dtype=float)  # None becomes NaN
