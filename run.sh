#!/usr/bin/env bash
# Installs what is missing, builds, and opens the program on the demonstration with the simulated tracker.
# Without a display the same demonstration runs headless and leaves a report.
# With arguments the program gets those instead of the demonstration: ./run.sh my.fieldtrue
source "$(dirname "${BASH_SOURCE[0]}")/.ci/setup.sh"
build ci --target fieldtrue fieldtrue-cli

if [ -n "${DISPLAY:-}${WAYLAND_DISPLAY:-}" ]; then
  [ -n "${DISPLAY:-}" ] && export QT_QPA_PLATFORM="${QT_QPA_PLATFORM:-xcb}"
  exec "$BUILD/app/fieldtrue" "${@:---demo}"
fi

demo="$PWD/build/demonstration"
cli="$BUILD/app/fieldtrue-cli"
rm -rf "$demo" && mkdir -p "$demo"
echo "No display: running the demonstration headless, a simulated room with a steel floor."
"$cli" acquire --device simulated:speed=20 --scene resources/scenes/steel_floor.scene.json --plan grid:5x5x4@0.3048 \
  --auto --session "$demo/demonstration.fieldtrue"
"$cli" tables --session "$demo/demonstration.fieldtrue" --nodes "$demo/demonstration.nodes.csv" \
  --samples "$demo/demonstration.samples.csv"
"$cli" compare --nodes "$demo/demonstration.nodes.csv"
"$cli" report --session "$demo/demonstration.fieldtrue" --html "$demo/report.html"
echo "Report with pictures: $demo/report.html"
