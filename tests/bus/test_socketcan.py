import socket

import numpy as np
import pytest

from ema.bus import mmsg
from ema.bus.interface import open_bus, parse
from ema.bus.socketcan import _controller
from ema.core import frames as fr
from ema.core.errors import BusError
from ema.core.frames import FrameFlag
from ema.core.status import BusState


def test_frames_to_the_kernels_layout_and_back():
    generator = np.random.default_rng(4)
    frames = fr.empty(200)
    fd = generator.random(200) < 0.5
    extended = generator.random(200) < 0.5
    frames["flags"] = fd * int(FrameFlag.FD) | extended * int(FrameFlag.EXTENDED)
    frames["id"] = generator.integers(0, 1 << 29, 200) & np.where(extended, 0x1FFFFFFF, 0x7FF)
    frames["length"] = np.where(fd, generator.choice([0, 8, 12, 24, 48, 64], 200), generator.integers(0, 9, 200))
    frames["data"] = generator.integers(0, 256, (200, 64)) * (np.arange(64) < frames["length"][:, None])
    raw = np.zeros(200, mmsg.CANFD_FRAME)
    size = mmsg.to_kernel(frames, raw)
    assert set(size.tolist()) == {mmsg.CLASSIC_SIZE, mmsg.FD_SIZE}
    back = mmsg.from_kernel(mmsg.Received(raw, size, frames["t_ns"], 0))
    np.testing.assert_array_equal(back, frames)


@pytest.mark.skipif(not hasattr(socket, "AF_CAN"), reason="not Linux")
def test_interface_that_is_not_there_is_one_line():
    with pytest.raises(BusError, match="cannot be opened"):
        open_bus(parse("socketcan:nothere0"))


def test_unknown_option_is_one_line():
    with pytest.raises(BusError, match="colour"):
        open_bus(parse("socketcan:vcan0").model_copy(update={"options": {"colour": "red"}}))


BUS_OFF, RESTARTED, PROBLEM = 0x40, 0x100, 0x4


@pytest.mark.parametrize(
    ("told", "state"),
    [
        ([(PROBLEM, 0x04)], BusState.ACTIVE),  # warning
        ([(PROBLEM, 0x10)], BusState.ERROR_PASSIVE),
        ([(PROBLEM, 0x20), (0x80, 0x00)], BusState.ERROR_PASSIVE),  # a bus error says nothing of the state
        ([(PROBLEM, 0x20), (PROBLEM, 0x40)], BusState.ACTIVE),
        ([(PROBLEM, 0x10), (PROBLEM, 0x08)], BusState.ACTIVE),  # only a warning again
        ([(PROBLEM, 0x10), (BUS_OFF, 0x00)], BusState.BUS_OFF),
        ([(BUS_OFF, 0x00), (PROBLEM, 0x01)], BusState.BUS_OFF),  # an overflow says nothing of the state
        ([(BUS_OFF, 0x00), (RESTARTED, 0x00)], BusState.ACTIVE),
    ],
)
def test_the_controllers_state_is_read_from_its_error_frames(told, state):
    now = BusState.ACTIVE
    for classes, problem in told:
        now = _controller(classes, problem, now)
    assert now is state
