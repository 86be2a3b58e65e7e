#!/bin/sh
# The three processes of a run, by hand: copy this page and put a solver of your own in its place.
#
#   launch/run.sh SCENE [RUN_ID]        results go to out/<scene name>
#
# The programs are taken from $ROCKFALL_BIN, else from ../target/release beside this page, else from PATH.
# First the scene is written out with every default, so that all three read the same numbers; they compare it. The
# order of the three lines after that does not matter; in three terminals with one run id they do the same.

scene=${1:?usage: run.sh SCENE [RUN_ID]}
run=${2:-hand-$$}
out=out/$(basename "$scene" .toml)

here=$(dirname "$0")
bin=${ROCKFALL_BIN:-$here/../target/release}
if [ -d "$bin" ]; then PATH=$(cd "$bin" && pwd):$PATH; fi
for program in rockfall coupler dem-solver fem-solver; do
    command -v "$program" >/dev/null || { echo "error: $program is not there; set ROCKFALL_BIN" >&2; exit 2; }
done

resolved=$(mktemp) || exit 1
rockfall check "$scene" --resolved "$resolved" >/dev/null || exit $?

# Ctrl-C in a terminal reaches the three programs by itself, which then end in order.
trap : INT
trap 'kill -TERM "$coupler" 2>/dev/null' TERM

coupler run "$resolved" --run "$run" --out "$out" & coupler=$!
dem-solver serve "$resolved" --run "$run" --as dem --out "$out" & dem=$!
fem-solver serve "$resolved" --run "$run" --as fem --out "$out" & fem=$!

# A signal ends a wait early: wait until the coupler has really ended.
wait "$coupler"; code=$?
while kill -0 "$coupler" 2>/dev/null; do wait "$coupler"; code=$?; done

# Bad input: the coupler has never been there for the solvers. (A signal to one that the shell has not
# quite started yet would be lost, hence the pause.)
if [ "$code" -eq 2 ]; then sleep 1; kill "$dem" "$fem" 2>/dev/null; fi
wait "$dem" "$fem"
if [ "$code" -eq 2 ]; then rm -f "$resolved"; else mv "$resolved" "$out/scene.toml"; fi
exit "$code"
