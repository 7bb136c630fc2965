"""A Slurm cluster on one machine: a controller and nodes, each a host of its own in a network, UTS,
mount and PID namespace. They share the file system and one munge daemon."""

import os
import re
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

CONFIG = """\
ClusterName=papilla
SlurmctldHost=ctl(10.77.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
CredType=cred/munge
# How long a job that is queued again waits, too.
AuthInfo=socket={root}/munge.socket,cred_expire=10
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SlurmdParameters=config_overrides
StateSaveLocation={root}/ctl
SlurmdSpoolDir={root}/%n
SlurmctldPidFile={root}/ctl.pid
SlurmdPidFile={root}/%n.pid
SlurmctldLogFile={root}/ctl.log
SlurmdLogFile={root}/%n.log
SlurmdTimeout=10
SlurmctldTimeout=30
KillWait=30
MinJobAge=3600
ReturnToService=2
JobRequeue=1
MpiDefault=none
SwitchType=switch/none
SchedulerType=sched/backfill
SchedulerParameters=bf_interval=2,sched_interval=2
PreemptType=preempt/partition_prio
PreemptMode=REQUEUE
{nodes}
PartitionName=work Nodes=ALL Default=YES MaxTime=INFINITE PriorityTier=1 GraceTime=60 State=UP
PartitionName=urgent Nodes=ALL MaxTime=INFINITE PriorityTier=10 PreemptMode=OFF State=UP
"""
# A wait that lasts longer hangs.
LIMIT_S = 600.0


def until(what: str, is_so: Callable[[], bool]) -> None:
    """Waits, and says for what where that never comes."""
    end = time.monotonic() + LIMIT_S
    while not is_so():
        if time.monotonic() > end:
            raise TimeoutError(f"waited {LIMIT_S:.0f} s: {what}")
        time.sleep(0.5)


class Cluster:
    """Hosts ctl, n1, n2, ...; use as a context."""

    def __init__(self, root: Path, nodes: int, cores: int):
        self.root = root
        self.nodes = {f"n{i + 1}": f"10.77.0.{i + 11}" for i in range(nodes)}
        self.addresses = {"ctl": "10.77.0.1"} | self.nodes
        self.running: dict[str, subprocess.Popen] = {}
        self.prefix = f"papilla{os.getpid()}-"
        lines = [
            f"NodeName={name} NodeAddr={address} CPUs={cores} RealMemory=4000 State=UNKNOWN"
            for name, address in self.nodes.items()
        ]
        self.config = root / "slurm.conf"
        self.config.write_text(CONFIG.format(root=root, nodes="\n".join(lines)))
        hosts = ["127.0.0.1 localhost"] + [f"{a} {n}" for n, a in self.addresses.items()]
        (root / "hosts").write_text("\n".join(hosts) + "\n")
        # Nothing is held in control groups; slurmd looks for them all the same.
        (root / "cgroup.conf").write_text("CgroupPlugin=cgroup/v1\n")
        for name in self.addresses:
            (root / name).mkdir()
        self.environment = os.environ | {"SLURM_CONF": str(self.config)}

    def __enter__(self) -> "Cluster":
        try:
            self.start_network()
            self.start_munge()
            self.start("ctl")
            for name in self.nodes:
                self.start(name)
            until("nodes are idle", self.is_ready)
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        for name in list(self.running):
            self.kill(name)
        for name in self.addresses:
            subprocess.run(["ip", "netns", "delete", self.prefix + name], check=False, capture_output=True)

    def is_ready(self) -> bool:
        for host, process in self.running.items():
            if process.poll() is not None:
                log = (self.root / f"{host}.out").read_text(errors="replace")
                raise RuntimeError(f"{host} ended with {process.returncode}:\n{log}")
        return len(self.nodes_in("idle")) == len(self.nodes)

    def start_network(self) -> None:
        """A bridge in the controller's namespace, and a cable to each node."""

        def ip(host: str, *command: str) -> None:
            subprocess.run(["ip", "-n", self.prefix + host, *command], check=True)

        for name in self.addresses:
            subprocess.run(["ip", "netns", "add", self.prefix + name], check=True)
            ip(name, "link", "set", "lo", "up")
        ip("ctl", "link", "add", "br0", "type", "bridge")
        ip("ctl", "addr", "add", "10.77.0.1/24", "dev", "br0")
        ip("ctl", "link", "set", "br0", "up")
        for name, address in self.nodes.items():
            ip("ctl", "link", "add", name, "type", "veth", "peer", "name", "eth0", "netns", self.prefix + name)
            ip("ctl", "link", "set", name, "master", "br0", "up")
            ip(name, "addr", "add", f"{address}/24", "dev", "eth0")
            ip(name, "link", "set", "eth0", "up")

    def start_munge(self) -> None:
        key = self.root / "munge.key"
        key.write_bytes(os.urandom(1024))
        key.chmod(0o600)
        options = ["key-file", "socket", "pid-file", "log-file", "seed-file"]
        paths = [f"--{o}={self.root}/munge.{o.removesuffix('-file')}" for o in options]
        log = (self.root / "munge.out").open("wb")
        command = ["munged", "--foreground", "--force", *paths]
        self.running["munge"] = subprocess.Popen(command, stdout=log, stderr=log)
        until("munge listens", lambda: (self.root / "munge.socket").exists())

    def start(self, host: str) -> None:
        """Turns a host on."""
        daemon = ["slurmctld", "-D", "-i"] if host == "ctl" else ["slurmd", "-D", "-N", host]
        into = ["ip", "netns", "exec", self.prefix + host]
        own = ["unshare", "--uts", "--mount", "--pid", "--fork", "--kill-child", "--mount-proc"]
        script = 'hostname "$0" && mount --bind "$1" /etc/hosts && shift && exec "$@"'
        log = (self.root / f"{host}.out").open("ab")
        self.running[host] = subprocess.Popen(
            [*into, *own, "sh", "-c", script, host, str(self.root / "hosts"), *daemon],
            env=self.environment,
            stdout=log,
            stderr=log,
        )

    def kill(self, host: str) -> None:
        """Pulls a host's plug: everything on it ends at once, by kill -9."""
        process = self.running.pop(host)
        process.kill()
        process.wait()

    def run(self, *command: str) -> str:
        """What a command prints on the controller."""
        into = ["ip", "netns", "exec", self.prefix + "ctl"]
        done = subprocess.run([*into, *command], env=self.environment, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise RuntimeError(f"{command} ended with {done.returncode}:\n{done.stdout}{done.stderr}")
        return done.stdout

    def nodes_in(self, state: str) -> list[str]:
        try:
            found = self.run("sinfo", "--noheader", "--Node", "--partition=work", "--format=%N %T")
        except RuntimeError:
            return []
        return [line.split()[0] for line in found.splitlines() if line.split()[1].rstrip("*") == state]

    def jobs(self) -> list[dict[str, str]]:
        """All jobs and tasks, as scontrol has them."""
        lines = self.run("scontrol", "--oneliner", "show", "job").splitlines()
        return [dict(re.findall(r"(\S+?)=(\S*)", line)) for line in lines if line.startswith("JobId=")]
