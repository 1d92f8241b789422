"""What statuses and reasons mean, in words for people; pages explain what they show with these."""

from __future__ import annotations

STATUS_MEANING = {
    "valid": "the model explains the cycle, and all data were there",
    "degraded": "an estimate, but from less than all data, near a limit of the method, or with the model in doubt",
    "invalid": "data came, but nothing that could be used was made of them",
    "not_estimated": "nothing was tried",
}
REASON_MEANING = {
    "lost_frames": "frames were missing in the cycle",
    "corrupt_frames": "frames failed their check",
    "repeated_frames": "frames came twice",
    "reordered_frames": "frames came late",
    "gap_at_schedule": "an instant that is to be sampled has no data",
    "no_start": "the cycle's first marker did not come",
    "no_end": "the cycle's last marker did not come",
    "saturated": "a current is at the end of its converter's range",
    "start_state_unknown": "where in the play the cycle began was not measured",
    "model_in_doubt": "the residual is larger than the noise explains",
    "at_bound": "a fault is at 0 or 1",
    "unseparable": "the data cannot tell some faults from each other",
    "timeout": "frames stopped coming",
    "authentication": "frames in this actuator's name were refused as not authentic",
    "kernel_drops": "the receive buffer was full",
    "out_of_range": "outside the range that the model was built for",
    "late": "sent after its budget, or after one of a newer cycle",
    "current_a": "the current of phase A reads what the actuator cannot do",
    "current_b": "the current of phase B reads what the actuator cannot do",
    "current_c": "the current of phase C reads what the actuator cannot do",
    "current_sum": "the phase currents do not sum to zero",
    "user_position": "the position reads what the actuator cannot do",
    "rotor_angle": "the rotor's angle reads what the rotor cannot do",
    "two_speakers": "two senders speak in this actuator's name",
}
