"""The monitor without its surroundings: cycle assembly, measurement, identification, model check."""

from .jobs import Runner, answered, answers
from .monitor import ARBITER, Monitor
from .outputs import FIRST, Event, Identified, Job, Level, LostJob, Output, SampledEnvelope
from .reception import Reception
from .settings import ModelCheck, MonitorSettings, Slower
from .timeliness import Timeliness, Untimely, Verdict, marked_late

__all__ = [
    "ARBITER", "FIRST", "Event", "Identified", "Job", "Level", "LostJob", "ModelCheck", "Monitor", "MonitorSettings",
    "Output", "Reception", "Runner", "SampledEnvelope", "Slower", "Timeliness", "Untimely", "Verdict", "answered",
    "answers", "marked_late",
]  # fmt: skip
