import can
import numpy as np
import pytest

from ema.bus import interface
from ema.bus.interface import BusSettings, open_bus, parse
from ema.bus.port import MAX_BATCH
from ema.bus.python_can import PythonCanPort
from ema.core.errors import BusError
from ema.core.status import BusState


@pytest.mark.parametrize(
    ("text", "settings"),
    [
        ("auto", BusSettings()),
        ("vcan0", BusSettings(interface="socketcan", channel="vcan0")),
        ("socketcan:can1", BusSettings(interface="socketcan", channel="can1")),
        ("udp_multicast", BusSettings(interface="udp_multicast")),
        ("virtual:x", BusSettings(interface="virtual", channel="x")),
    ],
)
def test_a_word_on_the_command_line_names_a_bus(text, settings):
    assert parse(text) == settings


@pytest.mark.parametrize("word", ["virtual:test", "udp_multicast:239.74.163.99"])
def test_frames_cross_a_bus_unchanged(word, currents):
    sent = currents(50)
    with open_bus(parse(word)) as here, open_bus(parse(word)) as there:
        assert here.write(sent) == 50
        received = there.read(1.0)
        while received.size < 50:
            more = there.read(1.0)
            assert more.size
            received = np.concatenate([received, more])
        for name in ("id", "flags", "length", "data"):
            assert np.array_equal(received[name], sent[name])
        assert (np.diff(received["t_ns"].astype(np.int64)) >= 0).all()
        assert here.counters.n_sent == there.counters.n_received == 50
        assert there.read(0.0).size == 0


@pytest.mark.parametrize("word", ["virtual:test", "udp_multicast:239.74.163.99"])
def test_filters_let_only_the_wanted_messages_through(word, currents, codec):
    sent = currents(3)
    sent["id"][1] = codec.messages["Heartbeat"].frame_id
    with open_bus(parse(word)) as here, open_bus(parse(word), codec.filters("Actuator")) as there:
        here.write(sent)
        ids = there.read(1.0)["id"].tolist()
        while len(ids) < 2:
            ids += there.read(1.0)["id"].tolist()
        assert ids == sent["id"][[0, 2]].tolist()
        assert there.read(0.0).size == 0


@pytest.mark.parametrize("word", ["nowhere:x", "socketcan:there-is-no-such-interface", "udp_multicast:10.0.0.1"])
def test_a_bus_that_cannot_be_opened_is_one_line(word):
    with pytest.raises(BusError, match="cannot be opened"):
        open_bus(parse(word))


def test_auto_takes_the_next_best_and_says_why(monkeypatch):
    monkeypatch.setattr(interface, "VCAN", "no-such-vcan")
    monkeypatch.setattr(interface, "GROUP", "10.0.0.1")
    with open_bus(parse("auto")) as port:
        assert port.choice.startswith("bus virtual:ema chosen; bus socketcan:no-such-vcan cannot be opened (")
        assert "udp_multicast:10.0.0.1" in port.choice


class Controller(can.BusABC):
    """A controller whose driver tells its state."""

    state = can.BusState.ACTIVE

    def __init__(self):
        super().__init__("controller")

    def send(self, msg, timeout=None):
        pass


class Unplugged(Controller):
    @property
    def state(self):
        raise can.CanOperationError("the device has gone")


@pytest.mark.parametrize(
    ("told", "expected"),
    [
        (can.BusState.ACTIVE, BusState.ACTIVE),
        (can.BusState.PASSIVE, BusState.ERROR_PASSIVE),
        (can.BusState.ERROR, BusState.BUS_OFF),
        (None, BusState.BUS_OFF),  # of etas: neither active nor passive
    ],
)
def test_the_state_of_a_controller_is_what_its_driver_tells(told, expected):
    bus = Controller()
    bus.state = told
    with PythonCanPort(bus, "controller") as port:
        assert port.bus_state is expected


def test_a_driver_that_cannot_tell_its_state_any_more_is_down_and_says_why_once():
    with PythonCanPort(Unplugged(), "controller") as port:
        assert [port.bus_state, port.bus_state] == [BusState.DOWN, BusState.DOWN]
        assert port.take_events() == ["controller: the device has gone"]


class Storm(can.BusABC):
    """A controller that tells nothing but errors, as fast as it is asked."""

    def __init__(self):
        super().__init__("storm")
        self.n_asked = 0

    def _recv_internal(self, timeout):
        self.n_asked += 1
        return can.Message(is_error_frame=True), True

    def send(self, msg, timeout=None):
        pass


def test_a_storm_of_error_frames_does_not_keep_a_read():
    port = PythonCanPort(Storm(), "storm")
    assert port.read(10.0).size == 0
    assert 0 < port.counters.n_error_frames <= MAX_BATCH
    port.close()
