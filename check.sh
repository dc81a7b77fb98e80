#!/usr/bin/env bash
# The checks that take hours: ./check.sh [full | STAGE...]. Installs what is missing. The stages:
#   tsan        the tests of acquisition under ThreadSanitizer
#   tidy        clang-tidy over every file
#   clang       a build with clang
#   odr         the programs with -flto -Wodr, which finds a name that two files define differently
#   sanitizers  every test, those of the window included, under address and undefined sanitizers
# Started again it goes on where it stopped: a stage that passed at this commit is left out, and so are, in one that did
# not, the tests that passed and the files that were clean. What has passed stands in build/check/COMMIT.
source "$(dirname "${BASH_SOURCE[0]}")/.ci/setup.sh"
all_stages=(tsan tidy clang odr sanitizers)
stages=("$@")
[ "${1:-full}" = full ] && stages=("${all_stages[@]}")
for stage in "${stages[@]}"; do
  case " ${all_stages[*]} " in *" $stage "*) ;; *) sed -n '2,10s/^# \{0,1\}//p' "${BASH_SOURCE[0]}" >&2; exit 2 ;; esac
done
install_missing .ci/packages-check.txt
find_recordings
suppressions="$PWD/tests/support"
state="$PWD/build/check/$(git rev-parse --short HEAD)"
git diff --quiet HEAD || state+="-$(git diff HEAD | sha1sum | cut -c1-8)"
mkdir -p "$state"

# run_tests STAGE [arguments of ctest]: the tests of the stage's build that did not pass before.
run_tests() {
  local log="$state/$1.tests" passed
  touch "$log"
  passed="$(sed -nE 's|^ *[0-9]+/[0-9]+ Test +#[0-9]+: (\S+) .* Passed .*|\1|p' "$log" | sort -u | paste -sd'|')"
  on_display ctest --test-dir "build/$1" --output-on-failure -j2 -E "^(${passed:-none})\$" "${@:2}" | tee -a "$log"
}

stage_tsan() {
  build tsan --target acquisition_programs
  # Qt is not built for the sanitizer, so what its own code does is left out.
  TSAN_OPTIONS="suppressions=$suppressions/tsan.supp:ignore_noninstrumented_modules=1" run_tests tsan -L acquisition
}
stage_tidy() { .ci/tidy.py --all --done "$state/tidy.clean"; }
stage_clang() { build clang; }
stage_odr() { build odr --target fieldtrue fieldtrue-cli fieldtrue-pictures fieldtrue-blind; }
stage_sanitizers() {
  build sanitizers
  run_tests sanitizers
}

declare -A result
for stage in "${stages[@]}"; do
  result[$stage]="passed before"
  [ -f "$state/$stage.passed" ] && continue
  echo "== $stage"
  began=$SECONDS
  set +e
  (set -e; "stage_$stage") 2>&1 | tee "$state/$stage.log"
  status=${PIPESTATUS[0]}
  set -e
  minutes="$(((SECONDS - began + 59) / 60)) minutes"
  if [ "$status" = 0 ]; then
    touch "$state/$stage.passed"
    result[$stage]="passed, $minutes"
  else
    result[$stage]="FAILED, $minutes; see $state/$stage.log"
  fi
done
echo
failed=0
for stage in "${stages[@]}"; do
  printf '%-11s %s\n' "$stage" "${result[$stage]}"
  case "${result[$stage]}" in FAILED*) failed=1 ;; esac
done
exit "$failed"
