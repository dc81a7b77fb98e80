#!/usr/bin/env bash
# Installs what is missing, builds everything and runs every test. Arguments go to ctest: ./test.sh -R calib
# What was skipped, and why, stands before ctest's closing lines; the exit status is ctest's.
source "$(dirname "${BASH_SOURCE[0]}")/.ci/setup.sh"
build ci
find_recordings
set +e
# Many tests wait for what takes its time: three at once on two cores.
on_display ctest --test-dir "$BUILD" --output-on-failure -j3 "$@" |
  .ci/skips.py "$BUILD/Testing/Temporary/LastTest.log" ${FIELDTRUE_ALLOWED_SKIPS:+"$FIELDTRUE_ALLOWED_SKIPS"}
statuses=("${PIPESTATUS[@]}")
exit "$((statuses[0] != 0 ? statuses[0] : statuses[1]))"
