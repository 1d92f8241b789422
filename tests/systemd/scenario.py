"""What happens on the machine with systemd (see test_machine.py, which starts this there and judges what it wrote).

Runs as root on the machine's own Python, standard library only. Everything it does is printed (the transcript); what it
saw goes to facts.json; copies of the log directory go to folders named after the step.
"""

import json
import os
import secrets
import shutil
import signal
import subprocess
import time
from pathlib import Path

JOB = Path("/run/job")
BUS = "vcan0"
DAEMON = f"ema-daemon@{BUS}.service"
WORKER = f"ema-hf-worker@{BUS}.service"
SIMULATOR = "ema-simulator.service"
LOGS = Path(f"/var/log/ema/{BUS}")
PATIENCE = 240  # [s]; nothing is judged by how long it takes

facts: dict = {}


def main():
    install()
    start()
    start_worker()
    kill()
    hang()
    take_the_interface_away()
    lock_the_bus()
    package()
    facts["exposure"] = run("systemd-analyze", "security", "--no-pager", DAEMON, check=False).strip().splitlines()[-1]
    (JOB / "journal.txt").write_text(
        run("journalctl", "--no-pager", "-o", "short-monotonic", "-u", DAEMON, "-u", WORKER, "-u", SIMULATOR)
    )
    (JOB / "facts.json").write_text(json.dumps(facts, indent=1))
    # The daemon is still running: the power-off that follows has to stop it, and at-shutdown copies what it leaves.


def install():
    say("install the project from its wheel, the units, the network and sysctl files")
    (wheel,) = JOB.glob("*.whl")
    run("sh", JOB / "install_service", "install", wheel, "--no-deps")
    shutil.copy(JOB / "daemon.yaml", f"/etc/ema/{BUS}.yaml")
    shutil.copy(JOB / "scenario.yaml", "/etc/ema")
    shutil.copy(JOB / SIMULATOR, "/etc/systemd/system")
    shutil.copytree(JOB / "bundle", "/etc/ema/bundle")
    run("systemctl", "restart", "systemd-sysctl.service")
    facts["receive_buffer"] = int(Path("/proc/sys/net/core/rmem_max").read_text())
    run("systemctl", "daemon-reload")
    run("systemctl", "enable", "--quiet", DAEMON)
    run("systemctl", "restart", "systemd-networkd.service")  # makes vcan0, whose device unit wants the daemon
    wait("vcan0 is up", lambda: "UP" in run("ip", "-brief", "link", "show", BUS, check=False))
    facts["mtu"] = int(Path(f"/sys/class/net/{BUS}/mtu").read_text())


def start():
    say("the daemon starts by itself with the interface; the simulator is started")
    wait_until_running()
    wait("the alarm of a silent actuator is in the journal", alarms_in_the_journal)
    listen()
    run("systemctl", "start", SIMULATOR)
    facts["first_estimates"] = wait_for_estimates()
    facts["alarms"] = alarms_in_the_journal()
    facts["started"] = {**show("NRestarts", "MainPID", "MemoryCurrent", "User"), "status": status_of_main_process()}


def start_worker():
    say("the HF identifier in a unit of its own")
    run("systemctl", "start", WORKER)
    facts["hf_estimates"] = wait_for_estimates(1, "hf")
    run("systemctl", "stop", WORKER)


def kill():
    say("kill -9")
    before = show("NRestarts", "MainPID")
    keep("before_kill")
    os.kill(int(before["MainPID"]), signal.SIGKILL)
    wait("another process runs", lambda: show("MainPID")["MainPID"] not in ("0", before["MainPID"]))
    wait_until_running()
    facts["estimates_after_kill"] = wait_for_estimates()
    facts["killed"] = {"before": before, "after": show("NRestarts", "MainPID")}
    keep("after_kill")


def hang():
    say("hang: SIGSTOP; the watchdog has to end it")
    before = show("NRestarts", "MainPID")
    os.kill(int(before["MainPID"]), signal.SIGSTOP)
    wait("another process runs", lambda: show("MainPID")["MainPID"] not in ("0", before["MainPID"]))
    wait_until_running()
    facts["estimates_after_hang"] = wait_for_estimates()
    facts["hung"] = {"before": before, "after": show("NRestarts", "MainPID")}
    keep("after_hang")


def take_the_interface_away():
    say("delete vcan0 under the daemon and make it again")
    run("systemctl", "stop", SIMULATOR)
    run("ip", "link", "delete", BUS)
    wait("the daemon is stopped", lambda: show("ActiveState")["ActiveState"] in ("inactive", "failed"))
    facts["without_interface"] = show("ActiveState", "Result")
    keep("without_interface")
    run("ip", "link", "add", "dev", BUS, "type", "vcan")
    wait_until_running()
    listen()
    run("systemctl", "start", SIMULATOR)
    facts["estimates_after_interface"] = wait_for_estimates()


def lock_the_bus():
    say("message authentication: a key that only root can read, handed to the service by systemd")
    key = Path(f"/etc/ema/{BUS}.key")
    key.write_text(secrets.token_hex(16) + "\n")
    key.chmod(0o600)
    drop_in = Path(f"/etc/systemd/system/{DAEMON}.d/key.conf")
    drop_in.parent.mkdir()
    drop_in.write_text(f"[Service]\nLoadCredential=key:{key}\n")
    with Path(f"/etc/ema/{BUS}.yaml").open("a") as config:
        config.write(f"bus: {{key_file: /run/credentials/{DAEMON}/key}}\n")
    run("systemctl", "daemon-reload")
    run("systemctl", "restart", DAEMON)
    wait("the simulator's frames are refused: it has no key", lambda: "not authentic" in journal())
    with Path("/etc/ema/scenario.yaml").open("a") as scenario:
        scenario.write(f"bus: {{key_file: {key}}}\n")
    run("systemctl", "restart", SIMULATOR)
    facts["estimates_after_key"] = wait_for_estimates()


def package():
    say("the Debian package in place of the installed tree: install, upgrade, remove, install again")
    run("systemctl", "disable", "--now", "--quiet", DAEMON)
    # The tree stays for the simulator, which the monitor's package does not hold.
    run("env", "PREFIX=/nothing/there", "sh", JOB / "install_service", "uninstall")
    (deb,) = JOB.glob("*.deb")
    mine = Path(f"/etc/ema/{BUS}.yaml").read_text()
    run("dpkg", "--install", deb)
    run("systemctl", "enable", "--now", "--quiet", DAEMON)
    wait_until_running()
    facts["estimates_after_package"] = wait_for_estimates()
    facts["package_runs"] = os.readlink(f"/proc/{show('MainPID')['MainPID']}/exe"), executable()
    before = show("MainPID")["MainPID"]
    run("dpkg", "--install", deb)  # the same version again takes the way of an upgrade
    wait("the new version runs", lambda: show("MainPID")["MainPID"] not in ("0", before))
    wait_until_running()
    facts["estimates_after_upgrade"] = wait_for_estimates()
    run("dpkg", "--remove", "ema-monitor")
    keep("after_removal")
    facts["removed"] = {
        "left": [str(path) for path in (Path("/usr/lib/ema-monitor"), Path("/usr/bin/ema")) if os.path.lexists(path)],
        "state": show("ActiveState")["ActiveState"],
        "wanted": [str(path) for path in Path("/etc/systemd/system").glob("*.wants/ema-*")],
        "mine": Path(f"/etc/ema/{BUS}.yaml").read_text() == mine,
        "logs": len(list(LOGS.glob("*.mcap"))),
    }
    run("dpkg", "--install", deb)
    run("systemctl", "enable", "--now", "--quiet", DAEMON)
    wait_until_running()


def executable():
    return Path(f"/proc/{show('MainPID')['MainPID']}/cmdline").read_bytes().split(b"\0")[1].decode()


def journal():
    return run("journalctl", "--no-pager", "-u", DAEMON, check=False)


def alarms_in_the_journal():
    """What the journal holds of alarms, found as a tool would: by the message id."""
    found = run("journalctl", f"MESSAGE_ID={(JOB / 'message_id').read_text()}", "-o", "json", check=False)
    return [json.loads(line) for line in found.splitlines() if line.startswith("{")]


def listen():
    """The independent witness: every estimate on the bus, into bus.log."""
    filters = ",".join(f"{identifier}:1FFFFFFF" for identifier in json.loads((JOB / "ids.json").read_text()).values())
    words = f"exec candump -L {BUS},{filters} >>{JOB}/bus.log"
    subprocess.Popen(words, shell=True, start_new_session=True)


def say(text):
    print(f"== {text}", flush=True)


def run(*words, check=True):
    words = [str(word) for word in words]
    done = subprocess.run(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    if check:
        print(f"$ {' '.join(words)}\n{done.stdout}", end="", flush=True)
        done.check_returncode()
    return done.stdout


def show(*properties):
    text = run("systemctl", "show", DAEMON, *(f"--property={name}" for name in properties), check=False)
    return dict(line.split("=", 1) for line in text.splitlines())


def wait(what, condition):
    end = time.monotonic() + PATIENCE
    while not condition():
        if time.monotonic() > end:
            print(run("journalctl", "--no-pager", "-n", "60", check=False))
            print(run("systemctl", "status", "--no-pager", DAEMON, SIMULATOR, check=False))
            raise SystemExit(f"waited {PATIENCE} s in vain: {what}")
        time.sleep(0.2)
    print(f"   {what}", flush=True)


def wait_until_running():
    wait(
        "the daemon is ready",
        lambda: show("ActiveState", "SubState") == {"ActiveState": "active", "SubState": "running"},
    )


def wait_for_estimates(n=2, method="linear"):
    """Number of estimate frames of one method seen on the bus from now on, at least `n`."""
    log = JOB / "bus.log"
    identifier = json.loads((JOB / "ids.json").read_text())[method]
    begin = log.stat().st_size if log.exists() else 0

    def seen():
        if not log.exists():
            return 0
        with log.open("rb") as lines:
            lines.seek(begin)
            return lines.read().count(b" " + identifier.encode() + b"##")

    wait(f"{n} {method} estimates on the bus", lambda: seen() >= n)
    return seen()


def status_of_main_process():
    lines = Path(f"/proc/{show('MainPID')['MainPID']}/status").read_text().splitlines()
    return {
        key: value.strip()
        for key, _, value in (line.partition(":") for line in lines)
        if key in ("VmRSS", "Threads", "Uid")
    }


def keep(step):
    """Copies what is in the log directory now, as a power cut or a reader would find it."""
    subprocess.run(["cp", "-rL", str(LOGS), str(JOB / step)], check=True)
    print(f"   log kept as {step}: {sorted(path.name for path in (JOB / step).iterdir())}", flush=True)


if __name__ == "__main__":
    main()
