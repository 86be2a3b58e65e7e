#!/bin/sh
# The three processes of a run by hand, without supervision: copy this page to start a solver of your own in another way.
#
#   launch/run.sh SCENE [RUN_ID] [OPTION ...]        options are those of `rockfall run`, as --out DIR --set KEY=VALUE
#
# The programs are taken from $ROCKFALL_BIN, else from ../target/release beside this page, else from PATH; a solver of another
# make is the one that [processes] names. `rockfall run --print-commands` says what is started: first
#
#   rockfall check SCENE --resolved DIR/scene.toml    every default filled in, so that all read the same numbers; they compare it
#
# then, in any order or in three terminals (a scene of rocks or a net alone has one):
#
#   coupler    run   DIR/scene.toml --run RUN_ID --out DIR
#   dem-solver serve DIR/scene.toml --run RUN_ID --as dem --out DIR
#   fem-solver serve DIR/scene.toml --run RUN_ID --as fem --out DIR

scene=${1:?usage: run.sh SCENE [RUN_ID] [OPTION ...]}
shift
case ${1:--} in
    -*) run=hand-$$ ;;
    *) run=$1; shift ;;
esac

here=$(dirname "$0")
bin=${ROCKFALL_BIN:-$here/../target/release}
if [ -d "$bin" ]; then PATH=$(cd "$bin" && pwd):$PATH; fi
command -v rockfall >/dev/null || { echo "error: rockfall is not there; set ROCKFALL_BIN" >&2; exit 2; }

commands=$(rockfall run "$scene" "$@" --print-commands="$run") || exit $?
line() { printf '%s\n' "$commands" | sed -n "$1p"; }
eval "$(line 1)" >/dev/null || exit $?

# Ctrl-C in a terminal reaches the programs by itself, which then end in order.
trap : INT
trap 'kill -TERM "$leader" 2>/dev/null' TERM

eval "exec $(line 2)" & leader=$!
solvers=
for number in 3 4; do
    program=$(line $number)
    if [ "$program" ]; then eval "exec $program" & solvers="$solvers $!"; fi
done

# A signal ends a wait early: wait until the leader has really ended.
wait "$leader"; code=$?
while kill -0 "$leader" 2>/dev/null; do wait "$leader"; code=$?; done

# Bad input: the coupler has never been there for the solvers. (A signal to one that the shell has not
# quite started yet would be lost, hence the pause.)
if [ "$code" -eq 2 ] && [ "$solvers" ]; then sleep 1; kill $solvers 2>/dev/null; fi
wait $solvers
exit "$code"
