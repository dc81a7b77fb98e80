# Sourced by run.sh and test.sh: installs missing packages, configures and builds the `ci` preset.
# Leaves the current folder at the repository's root and sets BUILD to the build folder.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
BUILD="$PWD/build/ci"

installed() { [ "$(dpkg-query -W -f='${db:Status-Status}' "$1" 2>/dev/null)" = installed ]; }

install_missing() {
  local missing=() name optional
  while read -r name; do
    optional=0
    case "$name" in '' | '#'*) continue ;; '?'*) optional=1 name="${name#'?'}" ;; esac
    installed "$name" && continue
    if [ "$optional" = 1 ] && [ -z "$(apt-cache policy "$name" 2>/dev/null)" ]; then continue; fi
    missing+=("$name")
  done <.ci/packages.txt
  [ "${#missing[@]}" -eq 0 ] && return
  command -v apt-get >/dev/null || {
    echo "These packages are missing and there is no apt-get to install them: ${missing[*]}" >&2
    exit 1
  }
  local as_root=()
  [ "$(id -u)" = 0 ] || as_root=(sudo)
  echo "Installing ${#missing[@]} packages with apt-get${as_root:+ (as root, through sudo)}: ${missing[*]}"
  "${as_root[@]}" apt-get update -qq
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
}

build() {
  [ -f "$BUILD/build.ninja" ] || { echo "Configuring (once)"; cmake --preset ci >"$BUILD.log" 2>&1 || { cat "$BUILD.log" >&2; exit 1; }; }
  cmake --build --preset ci "$@"
}

# A private folder for Qt, which complains without one.
if [ -z "${XDG_RUNTIME_DIR:-}" ]; then
  XDG_RUNTIME_DIR="$(mktemp -d)"
  export XDG_RUNTIME_DIR
fi
mkdir -p build
install_missing
