"""From a simulated cycle to the frames an actuator sends, each with the time it is due."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ema.bus.codec import Codec
from ema.bus.identifiers import with_actuator
from ema.bus.protection import Sender
from ema.bus.span import MOTION_RATIO, N_CYCLES, SAMPLES_PER_FRAME, Span
from ema.core.names import CURRENTS

from .fleet import CycleData


class Traffic:
    """Encodes cycles of several actuators; keeps their running sequence numbers.

    Parameters
    ----------
    codec : Codec
    numbers : actuator numbers, one for each lane
    stagger : float
        Each lane begins its test motion so much after the one before it. [s]
    """

    def __init__(self, codec: Codec, numbers: Sequence[int], stagger: float = 0.0):
        self._codec = codec
        self._numbers = numbers
        self._stagger = stagger
        self._sender = Sender()
        self._chirp = codec.number("CycleStart", "motion_kind", "chirp")

    def frames(self, cycle: CycleData, period: float) -> tuple[np.ndarray, np.ndarray]:
        """Everything the actuators send from the start of a cycle to the start of the next.

        Returns
        -------
        frames : array, shape (n,), dtype FRAME_DTYPE
            Protected, in the order they are due.
        due : array, shape (n,)
            When each has to leave, since the start of the cycle. [s]
        """
        parts = [part for lane in range(len(self._numbers)) for part in self._of_actuator(cycle, lane, period)]
        frames = np.concatenate([f for f, _ in parts])
        due = np.concatenate([np.broadcast_to(d, f.size) for f, d in parts])
        order = np.argsort(due, kind="stable")
        return self._sender.protect(frames[order]), due[order]

    def _of_actuator(self, cycle: CycleData, lane: int, period: float) -> list[tuple[np.ndarray, np.ndarray]]:
        """Frames of one actuator with their due times; frames due together keep this order."""
        number, response = self._numbers[lane], cycle.response
        n_times, dt = cycle.t.size, float(cycle.t[1] - cycle.t[0])
        slow = slice(0, n_times, MOTION_RATIO)
        first_current, first_motion = (self._next_sequence(name, number) for name in ("PhaseCurrents", "Motion"))
        span = Span(cycle.number % N_CYCLES, first_current, first_motion, n_times, dt, self._chirp)
        begin = lane * self._stagger
        due_current = begin + np.arange(1, span.n_currents + 1) * SAMPLES_PER_FRAME * dt
        due_motion = begin + np.arange(1, span.n_motions + 1) * SAMPLES_PER_FRAME * MOTION_RATIO * dt
        due_motion[-1] = due_current[-1]
        n_supply = round(period / self._codec.messages["Supply"].period)
        due_supply = np.arange(n_supply) * period / max(n_supply, 1)
        currents = {name: _in_tens(i) for name, i in zip(CURRENTS, response.i[lane], strict=True)}
        motion = {
            "theta_u": _in_tens(response.theta_u[lane, slow]),
            "theta_m": _in_tens(response.theta_m[lane, slow] % (2 * np.pi)),
            "theta_cmd": _in_tens(cycle.theta_cmd[slow]),
        }
        u_dc = np.interp(due_supply, cycle.t, response.u_dc[lane])
        encode = self._codec.encode
        return [
            (encode("CycleStart", number, span._asdict()), np.array([begin])),
            (encode("PhaseCurrents", number, currents), due_current),
            (encode("Motion", number, motion), due_motion),
            (encode("CycleEnd", number, span._asdict()), due_current[-1:]),
            (encode("Supply", number, {"u_dc": u_dc, "temp_w": cycle.temp_w[lane]}), due_supply),
        ]

    def _next_sequence(self, name: str, number: int) -> int:
        return self._sender.next_sequence(with_actuator(self._codec.messages[name].frame_id, number))


def _in_tens(x: np.ndarray) -> np.ndarray:
    """Samples as rows of ten, the last row filled up with zeros."""
    return np.pad(x, (0, -x.size % SAMPLES_PER_FRAME)).reshape(-1, SAMPLES_PER_FRAME)
