"""What a worker process answers to a job: one line of JSON, checked like any other input before it is believed.

Whoever listens on the socket may be the worker of another bundle, an older one, or no worker at all. So an answer
repeats which job it is for and of which bundle, and has to be an estimate that such a job can have.
"""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from ema.bundle import Bundle
from ema.core.names import FAULTS
from ema.core.status import Reason, Status
from ema.identification import Estimate, NuisanceEstimate, Unbounded
from ema.monitor import Job

from .wire import WireError, WrongAnswer, fingerprint, plain, to_line

_ARRAYS = ("k", "sd", "covariance", "residual")
_NUISANCE = ("value", "sd", "covariance", "interval95")  # arrays of a NuisanceEstimate
_ROUNDING = 1e-9  # of limits, as a share of the span between them

Number = float | None  # None: NaN
Numbers = list[Number]
Whole = Annotated[int, Field(ge=0)]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)


class _Beside(_Strict):
    """A NuisanceEstimate."""

    names: list[str]
    units: list[str]
    value: list[float]
    sd: list[float]
    covariance: list[list[float]]
    interval95: list[list[float]]


class _Unbounded(_Strict):
    """An Unbounded."""

    k: list[float]
    own: list[list[float]]
    shared: list[list[float]]


class _Answer(_Strict):
    """An Estimate, and what it is the answer to."""

    bundle: str
    actuator: int
    cycle: int
    t_ns: int
    method: str
    k: Numbers
    sd: Numbers
    covariance: list[Numbers]
    chi2: Annotated[float, Field(ge=0)] | None
    dof: Whole
    p_value: Annotated[float, Field(ge=0, le=1)] | None
    residual: Numbers
    status: Whole
    reasons: Whole
    unseparable: list[list[float]]
    nuisance: _Beside | None
    unbounded: _Unbounded | None


class _Refusal(_Strict):
    error: str


def pack_answer(answer: Estimate, job: Job, bundle: str) -> bytes:
    """An estimate as a line; `bundle` is the fingerprint of the one used.

    What only its intervals are made from (`marginals`, `edges`) stays behind: the monitor asks for none.
    """
    content = {name: plain(getattr(answer, name)) for name in _ARRAYS}
    content |= {name: None if np.isnan(x := getattr(answer, name)) else float(x) for name in ("chi2", "p_value")}
    content["unseparable"] = [plain(direction) for direction in answer.unseparable]
    whose = {"bundle": bundle, "actuator": job.actuator, "cycle": job.cycle, "t_ns": job.t_ns, "method": answer.method}
    codes = {"dof": int(answer.dof), "status": int(answer.status), "reasons": int(answer.reasons)}
    free = answer.unbounded and {name: plain(values) for name, values in answer.unbounded._asdict().items()}
    return to_line(whose | content | codes | {"nuisance": _pack_beside(answer.nuisance), "unbounded": free})


def pack_error(error: Exception) -> bytes:
    """Why there is no estimate, as a line."""
    return to_line({"error": " ".join(str(error).split()) or repr(error)})


def unpack_answer(said: bytes, job: Job, bundle: Bundle) -> Estimate:
    """The estimate `job` asks for, made with `bundle`; WireError when there is none or it cannot be that."""
    if refusal := _refusal(said):
        raise WireError(refusal)
    try:
        answer = _Answer.model_validate_json(said)
        estimate = _estimate(answer)
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        where = ".".join(map(str, first["loc"])) or "the whole"
        raise WrongAnswer(f"the worker's answer makes no sense ({where}: {first['msg'].lower()})") from None
    except ValueError as error:
        raise WrongAnswer(f"the worker's answer makes no sense ({error})") from None
    odd = _of_another(answer, job, bundle) or _impossible(estimate, job, bundle)
    if odd:
        raise WrongAnswer(f"the worker's answer is not used: {odd}")
    return estimate


def _refusal(said: bytes) -> str:
    try:
        return _Refusal.model_validate_json(said).error or "no reason given"
    except ValidationError:
        return ""


def _pack_beside(beside: NuisanceEstimate | None) -> dict[str, Any] | None:
    if beside is None:
        return None
    numbers = {name: plain(getattr(beside, name)) for name in _NUISANCE}
    return {"names": list(beside.names), "units": list(beside.units), **numbers}


def _estimate(said: _Answer) -> Estimate:
    """ValueError where rows differ in length, or a code is none."""
    k, sd, covariance, residual = (np.array(getattr(said, name), float) for name in _ARRAYS)
    chi2, p_value = (np.nan if x is None else x for x in (said.chi2, said.p_value))
    if said.reasons >= 1 << len(Reason):
        raise ValueError(f"reasons = {said.reasons} has bits that mean nothing")
    return Estimate(
        *(said.method, k, sd, covariance, chi2, said.dof, p_value, residual),
        *(Status(said.status), Reason(said.reasons)),
        unseparable=tuple(np.array(direction, float) for direction in said.unseparable),
        nuisance=_beside(said.nuisance),
        unbounded=_free(said.unbounded),
    )


def _free(said: _Unbounded | None) -> Unbounded | None:
    return None if said is None else Unbounded(*(np.array(x, float) for x in (said.k, said.own, said.shared)))


def _beside(said: _Beside | None) -> NuisanceEstimate | None:
    if said is None:
        return None
    arrays = (np.array(getattr(said, name), float) for name in _NUISANCE)
    return NuisanceEstimate(tuple(said.names), tuple(said.units), *arrays)


def _of_another(said: _Answer, job: Job, bundle: Bundle) -> str:
    """What of the answer is another job's; empty if nothing is."""
    for name in ("method", "actuator", "cycle", "t_ns"):
        have, want = getattr(said, name), getattr(job, name)
        if have != want:
            return f"it is for {name} {str(have)[:40]}, asked was {want}"
    return "" if said.bundle == fingerprint(bundle) else "it was made with another bundle"


def _impossible(e: Estimate, job: Job, bundle: Bundle) -> str:
    """What no estimate of this job can have; empty if all is well."""
    n, valid = len(FAULTS), job.measurement.valid
    shapes = {"k": (n,), "sd": (n,), "covariance": (n, n), "residual": valid.shape}
    for name, shape in shapes.items():
        if getattr(e, name).shape != shape:
            return f"{name} has the shape {getattr(e, name).shape}, must be {shape}"
    numbers = np.concatenate([e.k, e.sd, e.covariance.ravel(), [e.chi2, e.p_value], e.residual[valid]])
    if np.isnan(numbers).any():
        given = np.isnan(numbers).all() and e.nuisance is e.unbounded is None and e.status > Status.DEGRADED
        return "" if given else "some of its numbers are missing"
    if e.k.min() < -_ROUNDING or e.k.max() > 1 + _ROUNDING:
        return f"k = {e.k.tolist()} is not within 0…1"
    if e.sd.min() < 0 or not np.allclose(e.covariance, e.covariance.T) or np.diag(e.covariance).min() < 0:
        return "its standard deviations or covariance are none"
    if any(d.shape != (n,) or not np.isclose(np.linalg.norm(d), 1) for d in e.unseparable):
        return "what it cannot tell apart is no direction of k"
    return _impossible_unbounded(e) or _impossible_beside(e.nuisance, bundle)


def _impossible_unbounded(e: Estimate) -> str:
    free, n = e.unbounded, len(FAULTS)
    if free is None:
        return "its estimate before the bounds is missing"
    if [part.shape for part in free] != [(n,), (n, n), (n, n)]:
        return "its estimate before the bounds has another shape"
    if any(np.linalg.eigvalsh(total).min() <= 0 for total in (free.own, free.own + free.shared)):
        return "the covariance of its estimate before the bounds is none"
    return ""


def _impossible_beside(beside: NuisanceEstimate | None, bundle: Bundle) -> str:
    expected = bundle.nuisance
    m = len(expected)
    if beside is None:
        return "its nuisance parameters are missing" if m else ""
    if (beside.names, beside.units) != (tuple(expected.names), tuple(expected.units)):
        return "its nuisance parameters are not the bundle's"
    shapes = {"value": (m,), "sd": (m,), "covariance": (m, len(FAULTS) + m), "interval95": (m, 2)}
    for name, shape in shapes.items():
        if getattr(beside, name).shape != shape:
            return f"{name} of its nuisance parameters has the shape {getattr(beside, name).shape}, must be {shape}"
    slack = _ROUNDING * (expected.high - expected.low)
    held = np.column_stack([beside.value, beside.interval95])
    inside = (held >= (expected.low - slack)[:, None]) & (held <= (expected.high + slack)[:, None])
    if not inside.all() or beside.sd.min(initial=0) < 0 or (np.diff(beside.interval95) < 0).any():
        return "its nuisance parameters are outside their range"
    return ""
