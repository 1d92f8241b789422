import json

import jsonschema
import numpy as np

from ema.core.status import LogState, Reason, ServiceState, Status
from ema.identification.estimate import Estimate
from ema.log import contents, schemas


def _check(kind, content):
    jsonschema.validate(json.loads(kind.encode(content).data), kind.schema)


def test_every_content_obeys_its_schema():
    nothing = np.full(6, np.nan)
    for result in (
        Estimate(
            "linear", np.full(6, 0.1), np.ones(6), np.eye(6), 1.0, 3, 0.5, np.array([3.0, np.nan, 4.0]),
            Status.DEGRADED, Reason.AT_BOUND | Reason.LOST_FRAMES,
        ),
        Estimate(
            "hf", nothing, nothing, np.eye(6), np.nan, 0, np.nan, np.full(3, np.nan), Status.INVALID, Reason.NO_END
        ),
    ):  # fmt: skip
        content = contents.estimate(5, 1, 2, result)
        _check(schemas.ESTIMATE, content)
    t = np.arange(3.0)
    _check(schemas.ENVELOPE, contents.envelope(5, 1, 2, t, t, t * np.nan, t))
    _check(schemas.EVENT, contents.event(5, "error", "code", "text"))
    _check(schemas.STATUS, contents.status(5, ServiceState.RUNNING, 1.0, LogState.OK, 1e9, {"n_lost": np.int64(3)}))


def test_the_residual_is_the_rms_of_what_was_measured():
    assert contents.rms(np.array([3.0, np.nan, 4.0])) == np.sqrt(12.5)
    assert contents.rms(np.array([np.nan])) is None
