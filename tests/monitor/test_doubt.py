from __future__ import annotations

import pytest
from pydantic import ValidationError

from ema.monitor import ModelCheck
from ema.monitor.doubt import ModelDoubt

FITS, NOT, UNKNOWN = 0.5, 1e-6, float("nan")


def judged(*p_values, **settings):
    doubt = ModelDoubt(ModelCheck(**settings))
    judgements = []
    for cycle, p in enumerate(p_values):
        doubt.update(cycle, p)
        judgements.append(doubt.doubted)
    return judgements, doubt


def test_single_cycles_do_not_matter():
    judgements, _ = judged(*[NOT, FITS, FITS, FITS, NOT] * 4)
    assert not any(judgements)


def test_three_of_five_do_and_are_named():
    judgements, doubt = judged(FITS, NOT, FITS, NOT, NOT)
    assert judgements == [False] * 4 + [True]
    assert doubt.cycles == [1, 3, 4]


def test_doubt_ends_when_none_of_the_last_cycles_speaks_against_the_model():
    judgements, _ = judged(NOT, NOT, NOT, FITS, FITS, FITS, FITS, FITS)
    assert judgements == [False, False, True, True, True, True, True, False]


def test_cycles_without_a_residual_say_nothing():
    judgements, _ = judged(NOT, UNKNOWN, NOT, UNKNOWN, UNKNOWN, NOT)
    assert judgements == [False] * 5 + [True]


def test_settings_that_can_never_act_are_refused():
    with pytest.raises(ValidationError, match="can never happen"):
        ModelCheck(cycles=3, failures=4)
