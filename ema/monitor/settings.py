"""How the monitor closes cycles, when slower identifiers run, and when it doubts its model."""

from __future__ import annotations

from pydantic import Field, model_validator

from ema.core.config import Settings
from ema.core.units import quantity
from ema.identification.fit import DOUBT_LEVEL


class Slower(Settings):
    """An identifier that does not run in every cycle."""

    every: float = quantity("s", "one cycle is chosen in each interval of this length, by the frames' time", ge=0.01)


class ModelCheck(Settings):
    """The model is in doubt when the residuals of several cycles are larger than its noise explains.

    An identifier itself marks a single cycle; here is said when that is more than bad luck.
    """

    level: float = quantity("", "a cycle with a smaller p-value speaks against it", DOUBT_LEVEL, gt=0, lt=1)
    cycles: int = Field(default=5, ge=1, le=1000, description="how many of the last cycles are looked at")
    failures: int = Field(default=3, ge=1, description="so many of them put the model in doubt; none clears it")

    @model_validator(mode="after")
    def _possible(self) -> ModelCheck:
        if self.failures > self.cycles:
            raise ValueError(f"failures = {self.failures} can never happen in {self.cycles} cycles")
        return self


class MonitorSettings(Settings):
    """Section `monitor` of the daemon's configuration."""

    timeout: float = quantity("s", "a cycle whose frames stop coming for this long is closed", 0.3, gt=0, le=60)
    grace: float = quantity("s", "how long CycleEnd waits for frames that it has overtaken", 0.01, ge=0, le=1)
    slower: dict[str, Slower] = Field(default={"lf2": Slower(every=5.0)}, description="by identifier")
    model_check: ModelCheck = ModelCheck()
