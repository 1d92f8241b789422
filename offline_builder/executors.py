"""Where the runs are computed: processes of this machine or a Dask cluster, both `concurrent.futures` executors."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context

from ema.core.errors import ConfigError


@contextmanager
def executor(workers: int | None = None, scheduler: str | None = None) -> Iterator[Executor]:
    """An executor for a campaign.

    Parameters
    ----------
    workers : int, optional
        Processes on this machine; one for each core if not given.
    scheduler : str, optional
        Address of a Dask scheduler. Its workers need this software; a task whose worker dies is given to another.

    Raises
    ------
    ConfigError
        Dask is not installed, or nobody answers at the address.
    """
    if scheduler is None:
        # Ctrl-C reaches every process of the terminal; it is this one's to stop the others.
        ignore = (signal.SIGINT, signal.SIG_IGN)
        with ProcessPoolExecutor(workers or os.cpu_count(), get_context("spawn"), signal.signal, ignore) as pool:
            yield pool
        return
    try:
        from distributed import Client
    except ImportError as error:
        raise ConfigError("--scheduler needs Dask: pip install 'ema-monitor[fleet]'") from error
    try:
        client = Client(scheduler, timeout="10s", set_as_default=False)
    except (OSError, ValueError) as error:
        raise ConfigError(f"--scheduler {scheduler}: no Dask scheduler answers there") from error
    with client, client.get_executor(pure=False, retries=3) as pool:
        yield pool
