"""Every status and reason has words."""

from ema.core.status import Reason, Status
from ema.core.words import REASON_MEANING, STATUS_MEANING


def test_every_status_is_explained():
    assert list(STATUS_MEANING) == [status.name.lower() for status in Status]


def test_every_reason_is_explained():
    assert {reason.name.lower() for reason in Reason} <= set(REASON_MEANING)
