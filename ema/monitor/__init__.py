"""The monitor without its surroundings: cycle assembly, measurement, identification, model check."""

from .jobs import Runner, answered, answers
from .monitor import ARBITER, FIRST, Monitor
from .outputs import Event, Identified, Job, Level, Output, SampledEnvelope
from .settings import ModelCheck, MonitorSettings, Slower

__all__ = [
    "ARBITER", "FIRST", "Event", "Identified", "Job", "Level", "ModelCheck", "Monitor", "MonitorSettings", "Output",
    "Runner", "SampledEnvelope", "Slower", "answered", "answers",
]  # fmt: skip
