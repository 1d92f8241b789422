"""Boot User-Mode Linux: a Linux kernel as an ordinary process, without privilege."""

import os
import shutil
import signal
import subprocess
import sys
import threading
from collections.abc import Iterable, Iterator
from pathlib import Path

HERE = Path(__file__).resolve().parent
KERNEL = "linux.uml"
LEAST_MEMORY, MOST_MEMORY = 512, 1024  # [MiB]
OUTPUT_BEGINS, OUTPUT_ENDS = "EMA-OUTPUT-BEGINS", "EMA-OUTPUT-ENDS"  # printed by the machine around its job's output


class MachineError(Exception):
    """The machine cannot be started here, or did not end by itself."""


def directory(path: Path) -> list[str]:
    """Kernel words for a directory of the host as the machine's root."""
    return ["root=/dev/root", "rootfstype=hostfs", f"rootflags={path}", "rw"]


def image(path: Path, changes: Path) -> list[str]:
    """Kernel words for a disk image as the machine's root; what the machine writes goes to the file `changes`."""
    return [f"ubd0={changes},{path}", "root=/dev/ubda", "rw"]


def boot(root: list[str], init: Path, job: Path, *, timeout: float) -> Iterator[str]:
    """Boot, yield the console's lines as they come, return when the machine has halted.

    Parameters
    ----------
    root : from `directory` or `image`.
    init : the machine's first process, as a path inside its root.
    job : directory of the host; the machine finds its path as EMA_JOB on the kernel's command line.
    timeout : the machine is killed after this time. [s]

    Raises
    ------
    MachineError : no such kernel, too little memory, or the time is over.
    """
    kernel = shutil.which(KERNEL)
    if kernel is None:
        raise MachineError(f"{KERNEL} is not installed: run tools/install_system_packages")
    words = [f"mem={_memory()}M", *root, f"init={init}", f"EMA_JOB={job}"]
    words += ["con=null", "con0=null,fd:1", "ssl=null", "quiet", f"uml_dir={job}"]
    machine = subprocess.Popen(
        [kernel, *words],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        env={**os.environ, **_wide_registers(job)},
        text=True,
        errors="replace",
        start_new_session=True,  # the guest's processes are the host's: one group to end them all
    )
    over = threading.Event()

    def end() -> None:
        over.set()
        os.killpg(machine.pid, signal.SIGKILL)

    clock = threading.Timer(timeout, end)
    clock.start()
    try:
        assert machine.stdout
        for line in machine.stdout:
            yield line.rstrip("\r\n")
    finally:
        clock.cancel()
        if machine.poll() is None and not over.is_set():
            os.killpg(machine.pid, signal.SIGKILL)
        machine.wait()
    if over.is_set():
        raise MachineError(f"the machine was still running after {timeout:g} s and was killed")


def relay(lines: Iterable[str], job: Path) -> int:
    """Print what the job's command prints; return its exit status.

    Raises
    ------
    MachineError : the machine halted before the command had ended.
    """
    around, inside = [], False
    for line in lines:
        if line in (OUTPUT_BEGINS, OUTPUT_ENDS):
            inside = line == OUTPUT_BEGINS
        elif inside:
            print(line, flush=True)
        else:
            around.append(line)
    status = job / "status"
    if not status.exists():
        print("\n".join(around[-40:]), file=sys.stderr)
        raise MachineError("the machine halted before the command had ended (its own lines are above)")
    return int(status.read_text())


def _memory() -> int:
    """The machine's memory, which it takes from /dev/shm as it uses it. [MiB]"""
    free = shutil.disk_usage("/dev/shm").free >> 20
    if free < LEAST_MEMORY:
        raise MachineError(f"/dev/shm has {free} MiB, {LEAST_MEMORY} are needed (for docker: --shm-size=1100m)")
    return min(MOST_MEMORY, free)


def _wide_registers(job: Path) -> dict[str, str]:
    """Environment that lets the kernel run on hosts with AMX; see wide_registers.c."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        print("no C compiler: on a host with AMX the machine will not boot", file=sys.stderr)
        return {}
    library = job / "wide_registers.so"
    source = HERE / "wide_registers.c"
    subprocess.run([compiler, "-O2", "-shared", "-fPIC", "-o", library, source, "-ldl"], check=True)
    return {"LD_PRELOAD": str(library)}
