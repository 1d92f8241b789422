"""Daemon and simulator in one process, for the in-process bus `virtual`, which no other process can reach.

    python -m ema_demo.together daemon --config daemon.yaml -- simulate --scenario scenario.yaml

Both are the commands themselves: the daemon in the main thread, the simulator beside it once the daemon is ready; when
the simulator has ended, the daemon is told to stop as a service manager would.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import time

from ema.cli import cli, main

from .stage import LAST_ANSWERS, address, service_manager


def run(daemon: list[str], simulate: list[str]) -> None:
    """Run both; exits as the daemon does, or with 1 when the simulator failed."""
    failed: list[BaseException] = []
    with service_manager() as manager:
        os.environ["NOTIFY_SOCKET"] = address(manager)

        def beside() -> None:
            while b"READY=1" not in manager.recv(4096):
                pass
            try:
                cli.main(simulate, standalone_mode=False)
                time.sleep(LAST_ANSWERS)
            except BaseException as error:  # told by the main thread
                failed.append(error)
            signal.raise_signal(signal.SIGTERM)

        threading.Thread(target=beside, daemon=True).start()
        sys.argv[1:] = daemon
        try:
            main()
        finally:
            if failed:
                sys.exit(f"ema: simulate: {failed[0]}")


if __name__ == "__main__":
    cut = sys.argv.index("--")
    run(sys.argv[1:cut], sys.argv[cut + 1 :])
