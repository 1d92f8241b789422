"""How far a fit that begins near the truth ends from it, in the deviations it claims: of rms one if these are true.

What is hidden stands beside shorts of all six phases, so that directions are flat in which they cancel. Seeds follow
from the commit, the case and a number.

    python -m benchmarks.deviations --case magnet_flux --case current_gain --each 2
"""

from __future__ import annotations

import click
import hidden_actuator as hidden
import hidden_cases as cases
import numpy as np

from benchmarks.discrepancy import recorded
from benchmarks.frozen import bench_seed, commit, seed
from benchmarks.strata import as_actuator
from ema.core.names import FAULTS
from ema.discrepancy.actuator.examine import split
from ema.discrepancy.actuator.fitting.comparators import take_step, tell_step
from ema.discrepancy.actuator.fitting.fit import fit
from ema.discrepancy.actuator.fitting.flat import settle
from ema.discrepancy.actuator.fitting.free import K_FREE, free
from ema.discrepancy.actuator.reading.conditions import take_recorded_conditions
from ema.discrepancy.actuator.reading.cycles import prepare
from ema.discrepancy.actuator.simulating.noise import Noise
from ema.discrepancy.actuator.simulating.plant import EmaPlant

CASES = ("viscous_drag", "magnet_flux", "recorder_gain", "current_gain")
APART = 0.1  # of a parameter's step, rms, by which a fit begins beside the truth


def deviations(case: str, s: int) -> dict[str, float]:
    """What each parameter is off by over its standard deviation."""
    rng = np.random.default_rng(s)
    values = cases.case(case).draw(rng)
    nominal = list(hidden.PLANTS.values())[int(rng.integers(len(hidden.PLANTS)))]
    motions, bench = hidden.drawn_motions(rng, nominal.GR), hidden.drawn_bench(rng)._replace(nominal=nominal)
    k = rng.uniform(0.01, 0.06, len(FAULTS)).tolist()
    data = prepare(as_actuator(nominal), [recorded(values, k, 6, bench_seed(s), motions, bench)])
    plant, _ = take_recorded_conditions(as_actuator(nominal), data.signals)
    ema, train = EmaPlant(plant, data, 1), split(data)[0]
    truth = dict(zip(FAULTS, k, strict=True)) | {p: of(values) for p, of in cases.case(case).parameters.items()}
    frees = (*K_FREE, *(free(p) for p in cases.case(case).parameters))
    start = {f.name: truth[f.name] + APART * f.step * float(rng.standard_normal()) for f in frees}
    noise = Noise(ema, start)
    if (step := tell_step(ema, noise, truth, train)) is not None:  # as a search does near the truth
        take_step(ema, step)
        noise = Noise(ema, start)
    found = settle(ema, noise, fit(ema, noise, frees, start, train, n_iterations=2), train)
    return {name: (found.point[name] - truth[name]) / sd for name, sd in found.sd.items()}


@click.command()
@click.option("--case", "names", multiple=True, default=CASES, show_default=True)
@click.option("--each", default=2, show_default=True, help="records of each case")
def main(names: tuple[str, ...], each: int) -> None:
    """Print the deviations, and their rms."""
    z: list[float] = []
    for name in names:
        for number in range(each):
            found = deviations(name, seed(commit(), f"deviations {name}", number))
            z += found.values()
            click.echo(f"{name} {number}: " + ", ".join(f"{p} {x:+.1f}" for p, x in found.items()))
    click.echo(
        f"{len(z)} values, rms {np.sqrt(np.mean(np.square(z))):.2f}, {sum(abs(x) < 1.96 for x in z)} within 1.96"
    )


if __name__ == "__main__":
    main()
