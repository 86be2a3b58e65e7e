#!/usr/bin/env python3
"""A study on HyperQueue: copy this script and change it to your site.

    pip install hyperqueue
    launch/engines/on_hyperqueue.py study.toml                              # server and workers on this machine
    launch/engines/on_hyperqueue.py study.toml --server ~/.hq-server --chunks 400    # a server that runs already
    launch/engines/on_hyperqueue.py study.toml --barrier barrier.toml --worst 20     # then the worst members against a barrier

The study is cut into chunks. Each is one task, `rockfall ensemble STUDY --members A..B`; the call without `--members`
then collects all chunks and writes the results. With --barrier each of the worst members is a task, too, of three
processes, before all is collected. With --server the tasks go to the workers of a server that was started with
`hq server start`; study, scene, terrain and results must be seen under the same path on all of them. Without it this script
starts a server and workers itself, which end with it.

It costs little to compute a chunk twice: one that is complete is left alone, one that was begun is gone on with. A task that
fails is tried again, tasks of a worker that is lost go to another, and the same command again goes on where it was, whatever
was killed. What a script that was killed had given to a server is still done there, before what comes after it. The first task
prepares the terrain for all others: give each ten seconds of work.

The programs are taken from $ROCKFALL_BIN, else from ../../target/release beside this script, else from PATH.
Exit codes are those of `rockfall ensemble`; 1: a chunk failed in every attempt, or the server was lost.
"""

import argparse
import ctypes
import os
import shutil
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

BAD_INPUT = 2
# Of <sys/prctl.h>: the signal that a process gets when the one that has started it ends.
PR_SET_PDEATHSIG = 1
# Chunks for each core of this machine: the last ones end at about the same time.
CHUNKS_PER_CORE = 8


def arguments():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("study", help="study file (TOML)")
    parser.add_argument("--out", help="where the results go [default: out/<study name>]")
    parser.add_argument("--chunks", type=int, help="number of tasks [default: 8 for each core of this machine]")
    parser.add_argument("--barrier", help="scene of a barrier, against which the worst members are run")
    parser.add_argument("--worst", type=int, default=20, help="how many [default: 20]")
    parser.add_argument("--threads", type=int, default=1, help="threads, and cores, of each task [default: 1]")
    parser.add_argument("--server", help="directory of a HyperQueue server that runs already")
    parser.add_argument("--cores", type=int, default=os.cpu_count(), help="cores of the worker here [default: all]")
    parser.add_argument("--attempts", type=int, default=3, help="how often a failing task is tried [default: 3]")
    given = parser.parse_args()
    for name in ["chunks", "worst", "threads", "cores", "attempts"]:
        if (value := getattr(given, name)) is not None and value < 1:
            parser.error(f"--{name}: {value} is not 1 or more")
    if given.server is None and given.threads > given.cores:
        parser.error(f"tasks of {given.threads} threads find no place on a worker of {given.cores} cores")
    return given


class Lost(Exception):
    """The server does not answer any more."""


def refuse(words):
    print(f"error: {words}", file=sys.stderr)
    sys.exit(BAD_INPUT)


def reason(error):
    """What HyperQueue says, without where in its own program."""
    words = str(error).split("Stack backtrace:")[0]
    return " ".join(words.split()).rstrip(".")


def program():
    own = Path(os.environ.get("ROCKFALL_BIN", Path(__file__).resolve().parent / "../../target/release"))
    found = shutil.which("rockfall", path=f"{own.resolve()}{os.pathsep}{os.environ['PATH']}")
    if found is None:
        refuse("rockfall is not there; set ROCKFALL_BIN")
    return found


def ranges(rockfall, study, count):
    """The parts of the study, as `--members` takes them. Bad input ends here."""
    made = subprocess.run(
        [rockfall, "ensemble", study, "--chunks", str(count)], stdout=subprocess.PIPE, text=True
    )
    if made.returncode != 0:
        sys.exit(made.returncode)
    return made.stdout.split()


def connect(server):
    """A client of a server that runs already."""
    from hyperqueue import Client

    try:
        return Client(server)
    except Exception as error:
        refuse(f"--server {server}: {reason(error)}; give the directory of a server that runs")


def choose(task):
    """The worst members. What is started here ends with this script."""
    libc = ctypes.CDLL(None)
    made = subprocess.run(
        task + ["--list-worst"],
        stdout=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: libc.prctl(PR_SET_PDEATHSIG, signal.SIGKILL),
    )
    if made.returncode != 0:
        sys.exit(made.returncode)
    return made.stdout.split()


def submit(client, given, task, parts, log):
    """Compute these parts; those that failed, each with what HyperQueue says of it."""
    from hyperqueue import Job
    from hyperqueue.ffi.protocol import ResourceRequest

    # One task that fails does not end the others.
    job = Job(default_workdir=os.getcwd(), max_fails=None)
    for part in parts:
        job.program(
            task + [part],
            env=dict(os.environ),
            name=part,
            stdout="/dev/null",
            stderr=str(log / f"{part}.log"),
            resources=ResourceRequest(cpus=given.threads),
        )
    try:
        submitted = client.submit(job)
        if client.wait_for_jobs([submitted], raise_on_error=False):
            return {}
        failed = client.get_failed_tasks(submitted)
    except Exception as error:
        raise Lost(reason(error)) from error
    return {job.task_by_id(number).name: context.error for number, context in failed.items()}


def compute(client, given, task, parts, log):
    """All parts, each the last argument of a task, with as many attempts as were asked for; an exit code."""
    for attempt in range(1, given.attempts + 1):
        failed = submit(client, given, task, parts, log)
        if not failed:
            return 0
        parts = [part for part in parts if part in failed]
        for part in parts[:3]:
            print(f"{task[-1]} {part}, attempt {attempt}: {failed[part].strip()}", file=sys.stderr)
            print((log / f"{part}.log").read_text(errors="replace")[-2000:], file=sys.stderr)
        # Bad input does not become better.
        if any(f"exit code {BAD_INPUT}" in words for words in failed.values()):
            return BAD_INPUT
    print(f"error: {len(parts)} tasks failed; what they printed is in {log}", file=sys.stderr)
    return 1


def main():
    given = arguments()
    try:
        from hyperqueue import LocalCluster
        from hyperqueue.cluster import WorkerConfig
    except ImportError as missing:
        refuse(f"{missing}; pip install hyperqueue")
    rockfall = program()
    out = Path(given.out or Path("out") / Path(given.study).stem).resolve()
    study = str(Path(given.study).resolve())
    task = [rockfall, "ensemble", study, "--out", str(out)]
    if given.barrier:
        task += ["--barrier", str(Path(given.barrier).resolve()), "--worst", str(given.worst)]
    parts = ranges(rockfall, study, given.chunks or CHUNKS_PER_CORE * (os.cpu_count() or 1))
    log = out / "log"
    log.mkdir(parents=True, exist_ok=True)

    def both(client):
        """The study, then the members against the barrier. What of these fails, the call that collects says."""
        code = compute(client, given, task + ["--threads", str(given.threads), "--members"], parts, log)
        if code == 0 and given.barrier:
            compute(client, given, task + ["--run-worst"], choose(task), log)
        return code

    try:
        if given.server:
            code = both(connect(given.server))
        else:
            with tempfile.TemporaryDirectory(prefix="rockfall-hq-") as own:
                with LocalCluster(server_dir=own, worker_config=WorkerConfig(cores=given.cores)) as cluster:
                    code = both(cluster.client())
    except Lost as lost:
        print(f"error: the HyperQueue server is lost: {lost}; the same command again goes on", file=sys.stderr)
        return 1
    if code == 0:
        # In place of this script: who kills it, kills what collects, and nothing is left that writes the results.
        os.execv(rockfall, task if given.barrier else task + ["--resume"])
    return code


if __name__ == "__main__":
    sys.exit(main())
