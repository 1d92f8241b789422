"""What daemon and worker process say to each other over a Unix socket: one line of JSON for a job, one for its answer.

Floats go through JSON without losing a bit; NaN is null. Answers have a file of their own, `answer`.
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from ema.bundle import Bundle
from ema.core.config import digest
from ema.core.status import Reason
from ema.identification import Measurement
from ema.monitor import Job

MAX_LINE = 1 << 20  # [B]
PROBE = b'{"probe": true}\n'  # no job, so the answer is that it is none: whoever gives one is alive


class WireError(Exception):
    """The other side is not there, does not answer, says why it cannot, or says what makes no sense."""


class WrongAnswer(WireError):
    """An answer that cannot be that to the job: whoever gives it is not listened to any more."""


def fingerprint(bundle: Bundle) -> str:
    """What both sides must agree on: plant and contents of the bundle."""
    arrays = bundle.manifest["arrays"]
    return digest(bundle.plant) + "".join(arrays[name]["sha256"][:8] for name in sorted(arrays))


def pack_job(job: Job, bundle: Bundle) -> bytes:
    """A job as a line."""
    m = job.measurement
    return to_line(
        {
            "bundle": fingerprint(bundle),
            "method": job.method,
            "actuator": job.actuator,
            "cycle": job.cycle,
            "t_ns": job.t_ns,
            "i_hat": plain(m.i_hat),
            "start": None if m.start is None else plain(m.start),
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


def to_line(content: dict[str, Any]) -> bytes:
    """One line of JSON."""
    return json.dumps(content, allow_nan=False).encode() + b"\n"


def _read(line: bytes) -> dict[str, Any]:
    try:
        said = json.loads(line)
    except (ValueError, RecursionError) as error:
        raise WireError("not JSON") from error
    if not isinstance(said, dict):
        raise WireError("not a JSON object")
    return said


def plain(x: np.ndarray) -> Any:
    """An array as nested lists, NaN as None."""
    values = x.astype(object)
    values[np.isnan(x)] = None
    return values.tolist()


def _array(values: Any) -> np.ndarray:
    return np.array(values, dtype=float)  # None becomes NaN
