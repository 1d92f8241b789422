"""What the demo shows while it flies: the estimates as they come over the bus."""

from __future__ import annotations

import time

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from ema.bus import codec
from ema.bus.interface import open_bus, parse
from ema.core.closing import Closing
from ema.core.names import FAULTS

SHOWN_FROM = 0.005  # a fault


class Watch(Closing):
    """Listens to the monitor's frames on the bus, as any other node could."""

    def __init__(self, bus: str, n_cycles: int, console: Console):
        self._codec = codec.default()
        self._port = open_bus(parse(bus), self._codec.filters("Monitor"))
        self._bar = Progress(
            TextColumn("flight"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(),
            TextColumn("{task.description}"), console=console,
        )  # fmt: skip
        self._task = self._bar.add_task("simulator starts", total=n_cycles)
        self._bar.start()

    def look(self, duration: float) -> None:
        """Show what comes within `duration` [s]."""
        end = time.monotonic() + duration
        while (left := end - time.monotonic()) > 0:
            for message, frames in self._codec.split(self._port.read(left)):
                if message.name == "EstimateLinear":
                    values = message.decode(frames)
                    k = zip(FAULTS, values["k"][-1], strict=True)
                    seen = " ".join(f"{name} {x:.3f}" for name, x in k if x >= SHOWN_FROM) or "no fault seen"
                    self._bar.update(self._task, advance=len(frames), description=seen)

    def close(self) -> None:
        """Leave the terminal and the bus."""
        self._bar.stop()
        self._port.close()
