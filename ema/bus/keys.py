"""Keys of authentication: one for each node and direction, from a file that nobody else can read.

A line holds one key, ``bus HEX`` (or ``HEX`` alone) for all nodes or ``actuator 3 HEX`` for what one node sends. From
a bus's key every node's own is derived (HKDF, RFC 5869), so that one that leaks from a node speaks for that node only.
Of two lines for the same node the first one seals and both are accepted: so keys are changed without stopping.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import NamedTuple

from cryptography.hazmat.primitives.ciphers.algorithms import AES
from cryptography.hazmat.primitives.cmac import CMAC
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.kdf.hkdf import HKDF

from ema.core.errors import BusError
from ema.core.files import require_file

from .identifiers import N_ACTUATORS
from .nodes import Node

MAC_BYTES = 8
_LINE = re.compile(r"(?:(?:bus|(?P<role>actuator|monitor|tester) +(?P<number>\d{1,2})) +)?(?P<hex>[0-9a-fA-F]+)")
_VALID = 2  # keys of one node at once
_LARGEST = 1 << 16  # a key file [B]


class Key(NamedTuple):
    """What one node seals with."""

    number: int  # 0…255, tells keys apart during a change
    cmac: CMAC

    def mac(self, content: bytes) -> bytes:
        """AES-CMAC (RFC 4493), its first eight bytes."""
        cmac = self.cmac.copy()
        cmac.update(content)
        return cmac.finalize()[:MAC_BYTES]


class Keyring:
    """The keys of a bus.

    Parameters
    ----------
    secrets : mapping of Node, or None for the whole bus, to its keys, at most two, the one that seals first
    """

    def __init__(self, secrets: dict[Node | None, list[bytes]]):
        self._secrets = secrets
        self._keys: dict[Node, dict[int, Key]] = {}

    def keys(self, node: Node) -> dict[int, Key]:
        """The node's valid keys by number, the one that seals first; empty where it has none."""
        if node not in self._keys:
            own = self._secrets.get(node)
            secrets = self._secrets.get(None, []) if own is None else own
            made = (Key(_number(s), CMAC(AES(s if own else _derived(s, str(node))))) for s in secrets)
            self._keys[node] = {key.number: key for key in made}
        return self._keys[node]

    def sealing(self, node: Node) -> Key | None:
        """The key the node seals with; None where it has none."""
        return next(iter(self.keys(node).values()), None)


def _derived(secret: bytes, what: str, length: int | None = None) -> bytes:
    return HKDF(SHA256(), length or len(secret), salt=None, info=f"ema bus 2: {what}".encode()).derive(secret)


def _number(secret: bytes) -> int:
    return _derived(secret, "number", 1)[0]


def load_keys(path: Path) -> Keyring:
    """Keys from a file that nobody but its owner can read; BusError otherwise.

    What systemd hands to a service (LoadCredential=) only that can read, though its mode may look otherwise.
    """
    try:
        with require_file(path).open("rb") as file:
            status = os.fstat(file.fileno())
            raw = file.read(_LARGEST + 1)
        lines = raw.decode("ascii").splitlines()
    except OSError as error:
        raise BusError(f"key file {path}: cannot be read ({error.strerror})") from error
    except UnicodeDecodeError as error:
        raise BusError(f"key file {path}: cannot be read (not plain text)") from error
    if status.st_mode & 0o077 and Path(os.environ.get("CREDENTIALS_DIRECTORY", os.devnull)) not in path.parents:
        raise BusError(f"key file {path}: others can read it: chmod 600 {path}")
    if len(raw) > _LARGEST:
        raise BusError(f"key file {path}: is larger than {_LARGEST} bytes")
    secrets: dict[Node | None, list[bytes]] = {}
    for n, line in enumerate(lines, 1):
        text = line.partition("#")[0].strip()
        if text:
            node, secret = _read(text, f"key file {path}, line {n}")
            secrets.setdefault(node, []).append(secret)
    if not secrets:
        raise BusError(f"key file {path}: holds no key")
    for node, found in secrets.items():
        whose = "the bus" if node is None else str(node)
        if len(found) > _VALID:
            raise BusError(f"key file {path}: {len(found)} keys of {whose}; at most {_VALID} are valid at once")
        if len({_number(secret) for secret in found}) < len(found):
            raise BusError(f"key file {path}: the keys of {whose} cannot be told apart; make another one")
    return Keyring(secrets)


def _read(text: str, where: str) -> tuple[Node | None, bytes]:
    match = _LINE.fullmatch(text)
    if not match or len(match["hex"]) not in (32, 48, 64):
        raise BusError(
            f"{where}: must be [bus | actuator N | monitor N | tester N] and 32, 48 or 64 hexadecimal digits"
        )
    if match["role"] is None:
        return None, bytes.fromhex(match["hex"])
    number = int(match["number"])
    if number >= N_ACTUATORS:
        raise BusError(f"{where}: {number} is no actuator number, 0…{N_ACTUATORS - 1}")
    return Node(match["role"].capitalize(), number), bytes.fromhex(match["hex"])
