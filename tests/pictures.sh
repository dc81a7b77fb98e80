#!/usr/bin/env bash
# Renders the pictures of README and guide into resources/pictures, headless: the guided session in the window, page by page.
# Needs a finished build (./test.sh or ./run.sh). `tests/pictures.sh FOLDER` writes somewhere else.
set -euo pipefail
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
target="${1:-$root/resources/pictures}"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
render() { # render NAME TEST [VARIABLE=VALUE...]
  local name="$1" test="$2"
  shift 2
  mkdir -p "$work/$name"
  env QT_QPA_PLATFORM=xcb XDG_RUNTIME_DIR="$work" FIELDTRUE_ARTEFACTS="$work/$name" "$@" \
    xvfb-run --auto-servernum --server-args="-screen 0 2800x1800x24" \
    "$root/build/ci/tests/widgets_pages_tests" "$test" >"$work/$name.log" || { cat "$work/$name.log" >&2; exit 1; }
}
chmod 700 "$work"
for test in guided_session_test gap_page_test difference_page_test export_page_test export_sensors_test import_page_test \
  signal_page_test sensor_lines_test; do
  render light "$test"
  render dark "$test" FIELDTRUE_DARK=1
done
mkdir -p "$target"
cp "$work/light/4-acquire.png" "$target/acquire.png"
cp "$work/light/several-silent.png" "$target/acquire-sensors.png"
cp "$work/light/5-compare.png" "$target/compare.png"
cp "$work/dark/5-compare.png" "$target/compare-dark.png"
cp "$work/light/3-plan.png" "$target/plan.png"
cp "$work/light/5-compare-two.png" "$target/compare-two.png"
cp "$work/light/5-compare-slice.png" "$target/compare-slice.png"
cp "$work/light/5-place-and-curve.png" "$target/node.png"
cp "$work/light/6-gap.png" "$target/gap.png"
cp "$work/dark/6-gap.png" "$target/gap-dark.png"
cp "$work/light/6-gap-since.png" "$target/gap-since.png"
cp "$work/light/6-gap-provisional.png" "$target/gap-provisional.png"
cp "$work/light/6-gap-refused.png" "$target/gap-refused.png"
cp "$work/light/6-export.png" "$target/export.png"
cp "$work/light/6-export-sensors.png" "$target/export-sensors.png"
cp "$work/light/7-changes.png" "$target/changes.png"
cp "$work/light/7-changes-of-a-sensor.png" "$target/changes-sensor.png"
cp "$work/light/8-import.png" "$target/import.png"
cp "$work/light/3-signal.png" "$target/signal.png"
if [ -n "${FIELDTRUE_ALL_PICTURES:-}" ]; then cp -r "$work/light" "$work/dark" "$target/"; fi
echo "Pictures: $target"
