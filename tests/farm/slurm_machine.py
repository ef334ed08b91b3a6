"""Starts a Slurm on this machine for a test: munged, slurmctld and several slurmd, one per node. They use a folder,
configuration and ports of their own. No service of the system is used or changed. No accounting, no cgroups."""

import contextlib
import ctypes
import os
import pathlib
import pwd
import secrets
import shutil
import signal
import socket
import subprocess
import time

PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "scontrol", "squeue", "scancel", "sinfo")

CONFIG = """ClusterName=cumulet_test
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={controller_port}
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
CryptoType=crypto/munge
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool.%n
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.%n.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.%n.log
# What a sandbox has: no cgroups.
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
MpiDefault=none
SwitchType=switch/none
# Two nodes of one machine: what it has is not compared with what they say.
SlurmdParameters=config_overrides
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerParameters=batch_sched_delay=0,sched_interval=1,sched_min_interval=0,bf_interval=1
MaxArraySize={max_array}
ReturnToService=2
SlurmdTimeout={node_timeout}
KillWait=5
MessageTimeout=30
UnkillableStepTimeout=30
MinJobAge=300
# An exit that nobody asked for is told apart from a node that went.
JobRequeue=1
{nodes}
PartitionName=farm Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""


def free_ports(count):
    """Returns ports that are free now."""
    with contextlib.ExitStack() as stack:
        sockets = [stack.enter_context(socket.socket()) for _ in range(count)]
        for each in sockets:
            each.bind(("127.0.0.1", 0))
        return [each.getsockname()[1] for each in sockets]


def missing_programs():
    return [name for name in PROGRAMS if not find(name)]


def find(name):
    return shutil.which(name) or shutil.which(name, path="/usr/sbin:/sbin:/usr/bin")


def tree_of(root):
    """Returns the process and all its descendants, the deepest last."""
    children = {}
    for entry in pathlib.Path("/proc").iterdir():
        if entry.name.isdigit():
            with contextlib.suppress(OSError, ValueError):
                parent = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
                children.setdefault(parent, []).append(int(entry.name))
    found, queue = [], [root]
    while queue:
        found.append(queue.pop(0))
        queue += children.get(found[-1], [])
    return found


def command_of(process):
    with contextlib.suppress(OSError):
        return pathlib.Path(f"/proc/{process}/cmdline").read_bytes().split(b"\0")
    return []


def end_with_test():
    """The daemons die with the test, even if it is killed."""
    ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG


class SlurmMachine:
    def __init__(self, folder, nodes=2, max_array=1001, node_timeout=10):
        self.folder = pathlib.Path(folder)
        shutil.rmtree(self.folder, ignore_errors=True)
        for name in ("state", *(f"spool.node{i}" for i in range(nodes))):
            (self.folder / name).mkdir(parents=True)
        self.folder.chmod(0o755)
        self.nodes = [f"node{i}" for i in range(nodes)]
        self.daemons = {}
        host = socket.gethostname().split(".")[0]
        ports = free_ports(nodes + 1)
        lines = "\n".join(f"NodeName={name} NodeHostname={host} NodeAddr=127.0.0.1 Port={port} CPUs=1 RealMemory=1000"
                          for name, port in zip(self.nodes, ports[1:]))
        self.config = self.folder / "slurm.conf"
        self.config.write_text(CONFIG.format(folder=self.folder, host=host, controller_port=ports[0],
                                             user=pwd.getpwuid(os.getuid()).pw_name, nodes=lines, max_array=max_array,
                                             node_timeout=node_timeout))
        # Disables the search for cgroups, even if /etc configures them.
        (self.folder / "cgroup.conf").write_text(f"CgroupPlugin=cgroup/v1\nCgroupMountpoint={self.folder}/cgroup\n")
        self.environment = {**os.environ, "SLURM_CONF": str(self.config)}

    def __enter__(self):
        key = self.folder / "munge.key"
        key.write_bytes(secrets.token_bytes(128))
        key.chmod(0o400)
        try:
            self.start("munged", "--foreground", "--force", f"--socket={self.folder}/munge.socket", f"--key-file={key}",
                       f"--log-file={self.folder}/munged.log", f"--pid-file={self.folder}/munged.pid",
                       f"--seed-file={self.folder}/munged.seed")
            self.wait("munged", lambda: (self.folder / "munge.socket").exists())
            self.start("slurmctld", "-D", "-c")
            self.wait("slurmctld", lambda: self.ask("scontrol", "ping").returncode == 0)
            for node in self.nodes:
                self.start_node(node)
            self.wait("all nodes", lambda: self.states() == {node: "idle" for node in self.nodes})
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_):
        """Stops all daemons and jobs that this Slurm started."""
        for name, daemon in reversed(self.daemons.items()):
            if name != "munged":
                self.kill(daemon)
        for step in self.steps():
            self.kill_tree(step)
        if "munged" in self.daemons:
            self.kill(self.daemons["munged"])
        self.daemons.clear()

    def start(self, name, *arguments, key=None):
        log = open(self.folder / f"{key or name}.out", "ab")
        self.daemons[key or name] = subprocess.Popen([find(name), *arguments], stdin=subprocess.DEVNULL, stdout=log,
                                                     stderr=log, env=self.environment, start_new_session=True,
                                                     preexec_fn=end_with_test)
        log.close()

    def start_node(self, node):
        self.start("slurmd", "-D", "-N", node, key=node)

    def kill(self, daemon):
        with contextlib.suppress(ProcessLookupError):
            daemon.send_signal(signal.SIGKILL)
        daemon.wait()

    def steps(self, node=None):
        """Returns this Slurm's slurmstepd processes (they outlive slurmd), of one node or of all."""
        found = []
        for entry in pathlib.Path("/proc").iterdir():
            if entry.name.isdigit() and command_of(entry.name)[:1] and b"slurmstepd" in command_of(entry.name)[0]:
                with contextlib.suppress(OSError):
                    environment = (entry / "environ").read_bytes().split(b"\0")
                    if f"SLURM_CONF={self.config}".encode() not in environment:
                        continue
                    if node is None or self.node_of(entry.name) == node:
                        found.append(int(entry.name))
        return found

    def node_of(self, step):
        """Returns the node of a step. The environment of the step's own process does not name it, but that of its
        children does."""
        for process in tree_of(int(step))[1:]:
            with contextlib.suppress(OSError):
                for line in pathlib.Path(f"/proc/{process}/environ").read_bytes().split(b"\0"):
                    if line.startswith(b"SLURMD_NODENAME="):
                        return line.partition(b"=")[2].decode()
        return None

    def kill_tree(self, process):
        for each in tree_of(process):
            with contextlib.suppress(ProcessLookupError):
                os.kill(each, signal.SIGKILL)

    def kill_node(self, node):
        """Kills slurmd and all processes of the node, like a power failure."""
        steps = self.steps(node)
        self.kill(self.daemons.pop(node))
        for step in steps:
            self.kill_tree(step)
        return len(steps)

    def ask(self, program, *arguments):
        return subprocess.run([find(program), *arguments], env=self.environment, capture_output=True, text=True,
                              timeout=120)

    def states(self):
        return dict(line.split() for line in self.ask("sinfo", "-h", "-N", "-o", "%N %T").stdout.splitlines())

    def wait(self, what, is_true, seconds=120):
        end = time.monotonic() + seconds
        while not is_true():
            for name, daemon in self.daemons.items():
                assert daemon.poll() is None, f"{name} ended with {daemon.returncode}\n{self.logs()}"
            assert time.monotonic() < end, f"{what}: not within {seconds} s; nodes: {self.states()}\n{self.logs()}"
            time.sleep(0.2)

    def logs(self):
        texts = []
        for path in sorted([*self.folder.glob("*.log"), *self.folder.glob("*.out")]):
            texts.append(f"--- {path.name}\n" + "\n".join(path.read_text(errors="replace").splitlines()[-25:]))
        return "\n".join(texts)
