#!/usr/bin/env bash
# Draws and seals a set, answers it and its negative controls, and scores both:
#   tests/blind/test_set.sh SEED FOLDER [SESSIONS, default 1200] [JOBS, default all cores]
# Started again on the same folder it goes on where it stopped. To spread it over processes or machines, let each answer
# a part first (fieldtrue-blind answer --in FOLDER/set --from 1 --to 600, and so on): what is answered is left out.
# FIELDTRUE_APP names the folder of the two programs (default build/ci/app), FIELDTRUE_ROLE the role (default test).
set -euo pipefail
[ $# -ge 2 ] || { sed -n '2,6s/^# \{0,1\}//p' "${BASH_SOURCE[0]}" >&2; exit 2; }
seed=$1 folder=$2 sessions=${3:-1200} jobs=${4:-$(nproc)}
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)"
blind="${FIELDTRUE_APP:-$root/build/ci/app}/fieldtrue-blind"
limit=300
[ -x "$blind" ] || { echo "$blind is not built; cmake --build --preset ci --target fieldtrue-blind fieldtrue-cli" >&2; exit 1; }

mkdir -p "$folder"
[ -f "$folder/set/seal.json" ] || "$blind" generate --seed "$seed" --sessions "$sessions" --levels \
  --role "${FIELDTRUE_ROLE:-test}" --jobs "$jobs" --out "$folder/set"
echo "Sealed: $(tr -d '\n' <"$folder/set/seal.json")"
"$blind" answer --in "$folder/set" --jobs "$jobs" --limit "$limit"
[ -f "$folder/controls/seal.json" ] || "$blind" controls --in "$folder/set" --out "$folder/controls" --count 40
"$blind" answer --in "$folder/controls" --jobs "$jobs" --limit "$limit"
"$blind" foretell --in "$folder/set" --jobs "$jobs"
"$blind" score --in "$folder/set" --controls "$folder/controls" --json "$folder/score.json" --markdown "$folder/score.md"
