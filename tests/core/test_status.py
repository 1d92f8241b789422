from ema.core.status import Reason


def test_reasons_are_named_in_the_order_of_their_bits():
    assert (Reason.AT_BOUND | Reason.LOST_FRAMES).names == ["lost_frames", "at_bound"]
    assert Reason(0).names == []


def test_reasons_fit_their_thirty_two_bit_field():
    assert sum(Reason) == (1 << len(Reason)) - 1
    assert len(Reason) <= 32
