import pytest

from ema.bus.keys import load_keys
from ema.bus.nodes import Node
from ema.core.errors import BusError

A, B = "00" * 16, "11" * 16
ACTUATOR, MONITOR = Node("Actuator", 3), Node("Monitor", 3)


@pytest.fixture
def write(tmp_path):
    def make(text, mode=0o600):
        path = tmp_path / "key"
        path.write_text(text)
        path.chmod(mode)
        return path

    return make


def macs(ring, node):
    return [key.mac(b"x") for key in ring.keys(node).values()]


def test_every_node_has_a_key_of_its_own_from_that_of_the_bus(write):
    ring = load_keys(write(f"bus {A}\n"))
    nodes = [Node(role, n) for role in ("Actuator", "Monitor", "Tester") for n in range(64)]
    assert len({mac for node in nodes for mac in macs(ring, node)}) == len(nodes)
    assert macs(load_keys(write(A)), ACTUATOR) == macs(ring, ACTUATOR), "the word 'bus' may be left out"


def test_keys_may_be_given_one_by_one(write):
    ring = load_keys(write(f"# what this actuator needs\nactuator 3 {A}\n\nmonitor 3 {B}  # estimates\n"))
    assert len(ring.keys(ACTUATOR)) == len(ring.keys(MONITOR)) == 1
    assert ring.sealing(Node("Actuator", 4)) is None


def test_the_first_of_two_keys_seals_and_both_are_valid(write):
    ring = load_keys(write(f"{B}\n{A}\n"))
    assert len(ring.keys(ACTUATOR)) == 2
    assert [ring.sealing(ACTUATOR).mac(b"x")] == macs(load_keys(write(B)), ACTUATOR)


def test_hkdf_literature():
    """RFC 5869, test case 3 (no salt, no info): the library's HKDF is the one that derives keys."""
    from ema.bus import keys

    hkdf = keys.HKDF(keys.SHA256(), 42, salt=None, info=b"").derive(b"\x0b" * 22)
    assert hkdf.hex() == ("8da4e775a563c18f715f802a063c5a31b8a11f5c5ee1879ec3454e5f3c738d2d9d201395faa4b61a96c8")


@pytest.mark.parametrize(
    ("text", "mode", "said"),
    [
        (A, 0o644, "others can read it: chmod 600"),
        ("abc", 0o600, "line 1: must be .* 32, 48 or 64 hexadecimal digits"),
        ("x" * 32, 0o600, "hexadecimal digits"),
        (f"{A}\nactuator {B}", 0o600, "line 2: must be"),
        (f"actuator 64 {A}", 0o600, "64 is no actuator number, 0…63"),
        (f"{A}\n{B}\n{'22' * 16}", 0o600, "3 keys of the bus; at most 2"),
        (f"{A}\n{A}", 0o600, "cannot be told apart"),
        ("# nothing\n", 0o600, "holds no key"),
        ("é" * 32, 0o600, "cannot be read"),
        ("0" * 100_000, 0o600, "is larger than"),
    ],
)
def test_a_bad_key_file_is_refused_in_one_line(write, text, mode, said):
    with pytest.raises(BusError, match=said) as caught:
        load_keys(write(text, mode))
    assert "\n" not in str(caught.value)
    assert A not in str(caught.value), "no key is printed"


def test_a_key_file_that_is_not_there(tmp_path):
    with pytest.raises(BusError, match="cannot be read"):
        load_keys(tmp_path / "key")
