#!/usr/bin/env bash
# Installs what is missing, builds everything and runs every test. Arguments go to ctest: ./test.sh -R calib
source "$(dirname "${BASH_SOURCE[0]}")/.ci/setup.sh"
build
export QT_QPA_PLATFORM=xcb
exec xvfb-run --auto-servernum --server-args="-screen 0 1600x1000x24" ctest --test-dir "$BUILD" --output-on-failure -j2 "$@"
