"""A campaign on a Dask cluster of worker processes, one of them killed on the way: the same bits as here."""

from __future__ import annotations

import os
import signal
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from ema_offline_builder import campaign
from ema_offline_builder.executors import executor
from ema_offline_builder.runs import plan

from ema.core.errors import ConfigError


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_a_worker_killed_in_mid_campaign_costs_nothing(tiny, plant, tmp_path, monkeypatch):
    distributed = pytest.importorskip("distributed")
    monkeypatch.setattr(campaign, "BLOCK", 32)
    runs = plan(tiny, plant)
    with ThreadPoolExecutor(1) as pool:
        here = campaign.run(runs, plant, _made(tmp_path / "here"), pool)[:]

    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, host="127.0.0.1"
    ) as cluster:
        victims = [cluster.workers[0].pid]

        def kill(done: int, of: int) -> None:
            if done > 64 and victims:
                os.kill(victims.pop(), signal.SIGKILL)

        with executor(scheduler=cluster.scheduler_address) as pool:
            there = campaign.run(runs, plant, _made(tmp_path / "there"), pool, kill)[:]
    assert not victims, "a worker was to be killed"
    assert np.array_equal(here, there)


def test_no_scheduler_there_is_one_line():
    pytest.importorskip("distributed")
    with pytest.raises(ConfigError, match="no Dask scheduler answers"), executor(scheduler="nonsense://"):
        pass


def _made(folder):
    folder.mkdir()
    return folder
