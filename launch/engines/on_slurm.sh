#!/bin/sh
# A study on a Slurm cluster, as an array of tasks: copy this script and change it to your site.
#
#   launch/engines/on_slurm.sh STUDY CHUNKS [OPTIONS OF SBATCH]...
#   launch/engines/on_slurm.sh study.toml 200 --partition=long --time=2:00:00 --cpus-per-task=4
#   BARRIER=barrier.toml WORST=20 launch/engines/on_slurm.sh study.toml 200 --time=2:00:00
#
# The study is cut into CHUNKS parts. Each is one task, `rockfall ensemble STUDY --members A..B`, on as many threads as
# --cpus-per-task says. A last job collects all parts, computes what tasks have left undone, and writes the results to
# $OUT, else to out/<study name>. With $BARRIER the $WORST worst members (20) are run against that barrier then, each as a task
# of three processes, and a last job collects these too. This script waits for it and ends with its exit code. The same command
# again goes on: it takes the place of what this script had submitted before it was killed and still waits in the queue.
# Study, scene, terrain, results and this script must be seen under the same path on all nodes.
#
# The programs are taken from $ROCKFALL_BIN, else from ../../target/release beside this script, else from PATH.
# A task that is killed is tried again, three times in all; a task whose node is lost is queued again by Slurm (--requeue).
# It costs little to compute a part twice: a part that is complete is left alone, and one that was begun is gone on with.
set -eu

usage="usage: on_slurm.sh STUDY CHUNKS [OPTIONS OF SBATCH]..."
case ${1:-} in
task | choose | hit | collect) role=$1 && shift ;;
*) role=submit ;;
esac
study=${1:?$usage} chunks=${2:?$usage}
shift 2
out=${OUT:-out/$(basename "$study" .toml)}
threads=${SLURM_CPUS_PER_TASK:-1}
worst=${WORST:-20}

# The study, with the barrier if there is one.
ensemble() {
    rockfall ensemble "$study" --out "$out" ${BARRIER:+--barrier "$BARRIER" --worst "$worst"} "$@"
}

# A task that fails is tried again.
attempts() {
    # Cancelled: not again.
    trap 'exit 143' TERM
    for attempt in 1 2 3; do
        ensemble "$@" && exit 0 || code=$?
        # Bad input does not become better.
        if [ "$code" -eq 2 ]; then exit 2; fi
        echo "attempt $attempt of $* ended with exit code $code" >&2
    done
    exit "$code"
}

# Slurm runs a copy of this script: where the programs are is handed on to it in ROCKFALL_BIN.
bin=${ROCKFALL_BIN:-$(dirname "$0")/../../target/release}
if [ -d "$bin" ]; then
    ROCKFALL_BIN=$(cd "$bin" && pwd)
    export ROCKFALL_BIN
    PATH=$ROCKFALL_BIN:$PATH
fi

case $role in
submit)
    # As many tasks as there are parts: no more than members. Bad input ends here.
    parts=$(rockfall ensemble "$study" --chunks "$chunks")
    tasks=$(echo "$parts" | wc -l)
    mkdir -p "$out/log"
    # Named by the directory. What a script that was killed has left goes: what collects (first, else it begins as soon as its
    # tasks are gone), and tasks that wait. Tasks that run, run on.
    name=rockfall-$(cd "$out" && pwd | cksum | cut -d ' ' -f 1)
    scancel --quiet --user="$(id -un)" --name="$name-collect" || :
    scancel --quiet --user="$(id -un)" --state=PENDING --name="$name" || :
    after=
    for step in task choose hit collect; do
        # What writes the results of all is one process alone: not before one of an earlier call has ended (singleton).
        case $step in
        task) how="--array=1-$tasks --job-name=$name --open-mode=append" log=%a ;;
        hit) how="--array=1-$worst --job-name=$name --open-mode=append --dependency=afterany:$after" log=worst-%a ;;
        *) how="--job-name=$name-collect --dependency=afterany:$after,singleton" log=$step ;;
        esac
        if [ -z "${BARRIER:-}" ] && { [ "$step" = choose ] || [ "$step" = hit ]; }; then continue; fi
        if [ "$step" = collect ]; then how="$how --wait"; fi
        # Options without a blank in them, to be split.
        # shellcheck disable=SC2086
        job=$(sbatch --parsable --requeue $how --output="$out/log/$log.log" "$@" "$0" "$step" "$study" "$chunks") &&
            code=0 || code=$?
        # A cluster of several names the job as number;name.
        after=${job%%;*}
        if [ -z "$after" ]; then exit "$code"; fi
    done
    cat "$out/log/collect.log"
    exit "$code"
    ;;
task)
    attempts --members "$(rockfall ensemble "$study" --chunks "$chunks" | sed -n "${SLURM_ARRAY_TASK_ID}p")" --threads "$threads"
    ;;
choose)
    ensemble --list-worst --threads "$threads" >"$out/log/worst.txt"
    ;;
hit)
    # Fewer may have come to the line.
    member=$(sed -n "${SLURM_ARRAY_TASK_ID}p" "$out/log/worst.txt")
    [ -z "$member" ] || attempts --run-worst "$member"
    ;;
collect)
    [ -n "${BARRIER:-}" ] || set -- --resume
    ensemble "$@" --threads "$threads"
    ;;
esac
