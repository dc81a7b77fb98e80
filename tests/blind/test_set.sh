#!/usr/bin/env bash
# Draws and seals a test set, answers it and its negative controls, and scores both:
#   tests/blind/test_set.sh ENGINE FOLDER [--jobs J] [--parts N] [--sessions K] [--controls N] [--kinds B]
# --kinds B is the batch of unforeseen kinds (1, the oldest); a kind that a text or an answered set has shown is foreseen.
# ENGINE is the whole id of the commit that the diagnosis was frozen at, 40 digits: the seed is the first eight hexadecimal
# digits of the SHA-256 of it followed by `test`, and names the folder in tests/blind/results where the answers are kept, a
# hundred sessions a part. FOLDER holds the set while it is worked on and can be thrown away: started again, anywhere, the
# set is drawn again, what is kept is put back, and the rest is answered; --parts N ends after so many further parts.
# FIELDTRUE_APP names the folder of fieldtrue-blind (default build/ci/app), FIELDTRUE_CLI the program that is asked
# (default beside it), which must be that of ENGINE.
set -euo pipefail
[ $# -ge 2 ] || { sed -n '2,10s/^# \{0,1\}//p' "${BASH_SOURCE[0]}" >&2; exit 2; }
engine=$1 folder=$2 jobs=$(nproc) parts=1000000 sessions=1850 controls=300 kinds=1
shift 2
while [ $# -ge 2 ]; do
  case "$1" in
    --jobs) jobs=$2 ;;
    --parts) parts=$2 ;;
    --sessions) sessions=$2 ;;
    --controls) controls=$2 ;;
    --kinds) kinds=$2 ;;
    *) echo "test_set.sh: unknown option '$1'" >&2; exit 2 ;;
  esac
  shift 2
done
[[ "$engine" =~ ^[0-9a-f]{40}$ ]] || { echo "test_set.sh: ENGINE needs 40 hexadecimal digits, got '$engine'" >&2; exit 2; }
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)"
blind="${FIELDTRUE_APP:-$root/build/ci/app}/fieldtrue-blind"
cli="${FIELDTRUE_CLI:-${FIELDTRUE_APP:-$root/build/ci/app}/fieldtrue-cli}"
limit=600
for program in "$blind" "$cli"; do
  [ -x "$program" ] || { echo "$program is not built; cmake --build --preset ci --target fieldtrue-blind fieldtrue-cli" >&2; exit 1; }
done
name=$(printf '%stest' "$engine" | sha256sum | cut -c1-8)
results="$root/tests/blind/results/$name"
left=$parts

# answer_parts SET KEPT FORETOLD: goes on with a set until it is answered whole or $left parts were; 0: controls, which have
# no places to foretell.
answer_parts() {
  local count first
  [ -d "$2" ] && "$blind" restore --in "$1" --kept "$2"
  count=$(sed -n 's/.*"sessions": *\([0-9]*\).*/\1/p' "$1/seal.json")
  for ((first = 1; first <= count; first += 100)); do
    [ -f "$2/part_$(printf %02d $((first / 100 + 1))).json" ] && continue
    [ "$left" -gt 0 ] || return 0
    left=$((left - 1))
    "$blind" answer --in "$1" --cli "$cli" --jobs "$jobs" --limit "$limit" --from "$first" --to $((first + 99))
    [ "$3" = 0 ] || "$blind" foretell --in "$1" --cli "$cli" --jobs "$jobs"
    "$blind" keep --in "$1" --kept "$2" --engine "$engine"
  done
}

mkdir -p "$folder"
[ -f "$folder/set/seal.json" ] || "$blind" generate --seed $((16#$name)) --sessions "$sessions" --unforeseen "$kinds" --levels \
  --role "${FIELDTRUE_ROLE:-test}" --cli "$cli" --jobs "$jobs" --out "$folder/set"
echo "Sealed: $(tr -d '\n' <"$folder/set/seal.json")"
answer_parts "$folder/set" "$results" 1
[ "$left" -gt 0 ] || exit 0
[ -f "$folder/controls/seal.json" ] || "$blind" controls --in "$folder/set" --out "$folder/controls" --count 40 \
  --effect-free "$controls"
answer_parts "$folder/controls" "$results.controls" 0
[ "$left" -gt 0 ] || exit 0
"$blind" oracle --in "$folder/set" --jobs "$jobs"
"$blind" replicate --in "$folder/set" --cli "$cli" --jobs "$jobs"
"$blind" next --in "$folder/set" --cli "$cli" --jobs "$jobs"
"$blind" keep --in "$folder/set" --kept "$results" --engine "$engine"
"$blind" score --in "$folder/set" --controls "$folder/controls" --json "$results.json" --markdown "$results.md"
