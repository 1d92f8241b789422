"""Which bus: by configuration, or the best one this machine has."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from pydantic import Field

from ema.core.config import Settings, validate
from ema.core.errors import BusError, ConfigError

from .codec import default
from .multicast import GROUP, PORT, MulticastPort
from .port import RECEIVE_BUFFER, Filters, Port
from .socketcan import SocketCanPort

AUTO = "auto"
VCAN = "vcan0"


class OwnOptions(Settings):
    """Options of the ports of our own."""

    receive_buffer: int = Field(default=RECEIVE_BUFFER, ge=1, le=1 << 30, description="asked of the kernel [B]")


class MulticastOptions(OwnOptions):
    """Options of ``udp_multicast``."""

    port: int = Field(default=PORT, ge=1, le=65535, description="UDP port")


OWN: dict[str, tuple[Callable[..., Port], type[OwnOptions]]] = {
    "socketcan": (SocketCanPort, OwnOptions),
    "udp_multicast": (MulticastPort, MulticastOptions),
}


class BusSettings(Settings):
    """Where a program meets the others.

    `interface` is ``auto`` or an interface of python-can (``socketcan``, ``udp_multicast``, ``virtual``, ``pcan`` …);
    `options` are passed to that interface as they are. With a `key_file` every frame is authenticated, in and out; what
    must outlive the process for that, a number, is in `session_file`, by default beside the key file.
    """

    interface: str = AUTO
    channel: str = Field(default="", pattern=r"^[^\x00]*$")
    options: dict[str, Any] = Field(default_factory=dict)
    key_file: Path | None = None
    session_file: Path | None = None


def parse(text: str) -> BusSettings:
    """Settings of a command-line word: ``auto``, ``vcan0``, ``socketcan:can1``, ``udp_multicast``, ``virtual:x`` …"""
    if text == AUTO:
        return BusSettings()
    interface, colon, channel = text.partition(":")
    if colon:
        return BusSettings(interface=interface, channel=channel)
    if text in OWN or text in _of_python_can():
        return BusSettings(interface=text)
    return BusSettings(interface="socketcan", channel=text)


def elsewhere(settings: BusSettings, text: str) -> BusSettings:
    """The same bus at another place (see `parse`): with its key, and its options where they fit."""
    place = parse(text)
    options = settings.options if place.interface == settings.interface else {}
    return place.model_copy(update={"options": options, **settings.model_dump(include={"key_file", "session_file"})})


def open_bus(settings: BusSettings, filters: Filters | None = None, role: str = "Tester") -> Port:
    """Open the bus; its `choice` says what was taken and why. BusError when it cannot be opened.

    With `filters` only extended identifiers that agree with one of them are received (see `Codec.filters`); on a real
    CAN interface the kernel leaves out the rest before it costs anything. `role` is who this is, a sender of the DBC:
    where frames are authenticated, others are asked in its name.
    """
    opened = _open if settings.interface != AUTO else _open_best
    key_file = settings.key_file
    if key_file is None:
        return opened(settings, filters)
    from .authenticated import AuthenticatedPort, challenges, session_file_of

    port = opened(settings, filters if filters is None else [*filters, *challenges(default())])
    try:
        session_file = settings.session_file or session_file_of(key_file)
        return AuthenticatedPort(port, default(), key_file, session_file, role)
    except BusError:
        port.close()
        raise


def _open_best(settings: BusSettings, filters: Filters | None) -> Port:
    refused = []
    for interface, channel in (("socketcan", VCAN), ("udp_multicast", GROUP), ("virtual", "ema")):
        try:
            port = _open(settings.model_copy(update={"interface": interface, "channel": channel}), filters)
        except BusError as error:
            refused.append(str(error))
            continue
        port.choice = "; ".join([f"bus {port.name} chosen", *refused])
        return port
    raise BusError("; ".join(refused))


def _open(settings: BusSettings, filters: Filters | None) -> Port:
    interface, channel = settings.interface, settings.channel or _default_channel(settings.interface)
    name = f"{interface}:{channel}"
    if interface in OWN:
        kind, known = OWN[interface]
        try:
            given = validate(settings.options, known, f"bus {name} cannot be opened: options")
            return kind(channel, filters, **given.model_dump())
        except ConfigError as error:
            raise BusError(str(error)) from error
    import can

    from .python_can import PythonCanPort

    options: dict[str, Any] = {"fd": True} if interface != "virtual" else {"protocol": can.CanProtocol.CAN_FD}
    try:
        bus = can.Bus(interface=interface, channel=channel, **{**options, **settings.options})
    except (can.CanError, OSError, ValueError, TypeError, ImportError) as error:
        raise BusError(f"bus {name} cannot be opened ({_why(error)})") from error
    if filters is not None:
        bus.set_filters([{"can_id": i, "can_mask": mask, "extended": True} for i, mask in filters])
    return PythonCanPort(bus, name)


def _of_python_can() -> frozenset[str]:
    """Names of python-can's interfaces; importing it takes longer than opening a port of our own."""
    import can

    return frozenset(can.interfaces.VALID_INTERFACES)


def _default_channel(interface: str) -> str:
    return {"socketcan": VCAN, "udp_multicast": GROUP, "virtual": "ema"}.get(interface, "")


def _why(error: BaseException) -> str:
    root = error.__cause__ if isinstance(error.__cause__, OSError) else error
    return (root.strerror or str(root)) if isinstance(root, OSError) else str(root)
