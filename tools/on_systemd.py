"""Run a command on a machine whose init is a real systemd: a small Debian in User-Mode Linux.

    python tools/on_systemd.py --job DIR sh -c 'systemctl status'

The directory DIR of this machine is /run/job over there, for files in and out. The machine starts fresh each time, with
systemd up and with what the project requires in /opt/ema-monitor; the command is root there, and when it has ended the
machine powers off in order. A script DIR/at-shutdown runs after the last service has stopped. Output and exit status
are the command's. The Debian is built once (about a minute) and kept in the user's cache directory.
"""

import argparse
import hashlib
import shlex
import subprocess
import sys
from pathlib import Path

from platformdirs import user_cache_path

sys.path.insert(0, str(Path(__file__).resolve().parent / "uml"))
from machine import HERE, MachineError, boot, image, relay

REQUIREMENTS = HERE.parents[1] / "requirements-hf.lock"
INGREDIENTS = [HERE / "build_root", *sorted((HERE / "guest").iterdir()), REQUIREMENTS]
MODULES = Path("/usr/lib/uml/modules")


def main() -> int:
    """Read the arguments, see to the image, run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--timeout", type=float, default=600, help="hard end [s]")
    parser.add_argument("--job", type=Path, required=True, help="directory shared with the machine")
    parser.add_argument("command", nargs=argparse.REMAINDER)
    arguments = parser.parse_args()
    job = arguments.job.resolve()
    changes = job / "changes.cow"
    try:
        root = image(root_image(), changes)
        (job / "command.sh").write_text(f"cd /run/job\nexec {shlex.join(arguments.command)}\n")
        return relay(boot(root, Path("/sbin/init"), job, timeout=arguments.timeout), job)
    except MachineError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    finally:
        changes.unlink(missing_ok=True)


def root_image() -> Path:
    """The Debian's disk image, built if it is not in the cache or its ingredients have changed."""
    content = hashlib.sha256(b"".join(path.read_bytes() for path in INGREDIENTS))
    content.update(" ".join(sorted(path.name for path in MODULES.glob("*"))).encode())
    cache = user_cache_path("ema", ensure_exists=True)
    found = cache / f"systemd-{content.hexdigest()[:12]}.ext4"
    if not found.exists():
        for old in cache.glob("systemd-*.ext4*"):
            old.unlink()
        print(f"building {found} (about a minute)", flush=True)
        unfinished = found.with_suffix(".ext4.part")
        built = subprocess.run([HERE / "build_root", unfinished, REQUIREMENTS, sys.executable], check=False)
        if built.returncode:
            raise MachineError("the Debian could not be built (see above)")
        unfinished.rename(found)
    return found


if __name__ == "__main__":
    sys.exit(main())
