"""What is estimated beside the faults: on the bus, in the log, on the terminal, in the report."""

from __future__ import annotations

import threading

import cantools
import numpy as np
import pytest
from desks import loop
from ema_daemon.answer import pack_answer, unpack_answer
from ema_daemon.wire import fingerprint
from ema_daemon.worker import Worker
from ema_postflight.live import Live
from ema_postflight.page import page
from ema_postflight.picture import draw
from ema_postflight.report_settings import ReportSettings

from ema.bus import codec as codecs
from ema.core import config, resources
from ema.core.status import Reason
from ema.identification import Measurement
from ema.log import LogReader, LogWriter
from ema.monitor import Job, Monitor, MonitorSettings, Runner

FLUX = -0.05


@pytest.fixture(scope="module")
def flight(fly):
    weaker = {"effects": {"magnet_flux": {"change": FLUX}}}
    return np.concatenate([f for _, f in fly(n_cycles=3, seed=2, actuators=[weaker])])


@pytest.fixture(scope="module")
def ran(flux_bundle, flight, tmp_path_factory):
    """The daemon's loop on three cycles of an actuator with a weaker magnet: port and log folder."""
    from .conftest import ScriptedPort

    folder, bundles = tmp_path_factory.mktemp("log"), {0: flux_bundle}
    settings = MonitorSettings.model_validate({"slower": {"lf2": {"every": "1 s"}}})
    monitor = Monitor(bundles, codecs.default(), settings)
    worker = Worker(Runner(bundles).run, 8, "lf2")
    port = ScriptedPort([flight[i : i + 100] for i in range(0, flight.size, 100)], lambda: service.stop())
    with LogWriter(folder) as log, loop(monitor, port, log, {"lf2": worker}, folder) as service:
        service.run()
    assert threading.active_count() < 10
    return port, folder


def test_what_is_sent_is_what_is_logged_and_is_near_the_truth(ran):
    port, folder = ran
    with LogReader(folder) as log:
        logged = [m.content for m in log.messages() if m.topic == "/nuisance/0/linear"]
    sent = [one for one in _decoded(port) if str(one["method"]) == "linear"]
    assert len(sent) == len(logged) == 3
    for one, content in zip(sent, logged, strict=True):
        assert str(one["parameter"]) == content["parameter"] == "magnet_flux.change"
        for name in ("value", "sd", "low", "high"):
            assert one[name] == pytest.approx(content[name], rel=1e-6)
        assert content["low"] <= FLUX <= content["high"]
    assert np.mean([content["value"] for content in logged]) == pytest.approx(FLUX, abs=0.02)


def _decoded(port):
    witness = cantools.database.load_file(resources.dbc())
    message = witness.get_message_by_name("EstimateNuisance")
    own = [frame for batch in port.written for frame in batch if frame["id"] == message.frame_id]
    return [message.decode(frame["data"][: frame["length"]].tobytes()) for frame in own]


def test_it_is_shown_beside_the_faults(ran):
    from rich.console import Console

    port, folder = ran
    state = Live(codecs.default())
    state.update(np.concatenate(port.written))
    console = Console(record=True, width=160)
    console.print(draw(state, "scripted", int(port.written[-1]["t_ns"][-1]), 160, 50))
    assert "actuator 0, linear: magnet_flux.change = -0.0" in console.export_text()
    with LogReader(folder) as log:
        text = page(log, config.load(resources.config("report.yaml"), ReportSettings))
    assert "Beside the faults" in text
    assert "magnet_flux.change" in text


def test_the_worker_process_says_it_too(flux_bundle):
    i = flux_bundle.i0[flux_bundle.schedule]
    job = Job(0, 0, 7, "lf2", Measurement.complete(1.02 * i, np.zeros(2)), Reason(0))
    e = Runner({0: flux_bundle}).run(job)
    again = unpack_answer(pack_answer(e, job, fingerprint(flux_bundle)), job, flux_bundle).nuisance
    assert again.names == e.nuisance.names
    for name in ("value", "sd", "covariance", "interval95"):
        assert np.array_equal(getattr(again, name), getattr(e.nuisance, name))
