"""Run a command beside a real SocketCAN interface vcan0: on this kernel if it has one, else inside User-Mode Linux.

    python tools/on_vcan.py [--timeout 1800] .venv/bin/pytest -m vcan tests/vcan

Output and exit status are the command's. The interface is private to the command: this kernel's own vcan0, if there is
one, is not touched. The command runs in the present directory, sees this machine's files and has a root's rights over
its network only.
"""

import argparse
import os
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent / "uml"))
from machine import HERE, MachineError, boot, directory, relay

NATIVE = ["unshare", *([] if os.geteuid() == 0 else ["--map-root-user"]), "--net", "--mount", "sh", "-c"]


def main() -> int:
    """Read the arguments, choose the kernel, run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--timeout", type=float, default=1800, help="hard end [s]")
    parser.add_argument("command", nargs=argparse.REMAINDER)
    arguments = parser.parse_args()
    reason = why_not_native()
    if reason is None:
        print(f"vcan0 of this kernel, {os.uname().release}", flush=True)
        return run_natively(arguments.command, arguments.timeout)
    print(f"no vcan in this kernel ({reason}): User-Mode Linux", flush=True)
    try:
        return run_in_uml(arguments.command, arguments.timeout)
    except MachineError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2


def why_not_native() -> str | None:
    """Why this kernel gives us no vcan0, in one line; None if it does."""
    try:
        trial = subprocess.run([*NATIVE, f"set -e; . {HERE}/vcan_up.sh"], capture_output=True, text=True, check=False)
    except OSError as error:
        return str(error)
    return None if trial.returncode == 0 else (trial.stderr.strip() or "unknown reason").splitlines()[-1]


def run_natively(command: list[str], timeout: float) -> int:
    """In a network namespace of its own."""
    script = f"set -e; . {HERE}/vcan_up.sh; exec {shlex.join(command)}"
    try:
        return subprocess.run([*NATIVE, script], check=False, timeout=timeout).returncode
    except subprocess.TimeoutExpired:
        print(f"error: still running after {timeout:g} s, killed", file=sys.stderr)
        return 2


def run_in_uml(command: list[str], timeout: float) -> int:
    """In a User-Mode Linux on this machine's file system."""
    with tempfile.TemporaryDirectory(prefix="ema-uml-") as name:
        job = Path(name)
        kept = {name: os.environ[name] for name in ("PATH", "HOME", "LANG") if name in os.environ}
        settings = {**kept, "TMPDIR": "/run/tmp", "COLUMNS": "120"}
        if not sys.stdout.isatty():
            settings["NO_COLOR"] = "1"  # the machine's console claims to be a terminal
        lines = [f"export {key}={shlex.quote(value)}" for key, value in settings.items()]
        lines += [f"cd {shlex.quote(os.getcwd())}", f"exec {shlex.join(command)}"]
        (job / "command.sh").write_text("\n".join(lines) + "\n")
        return relay(boot(directory(Path("/")), HERE / "init_host.sh", job, timeout=timeout), job)


if __name__ == "__main__":
    sys.exit(main())
