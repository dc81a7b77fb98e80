# Sourced by run.sh, test.sh, check.sh and .ci/run: installs missing packages; functions to build a preset and to run its
# tests. Leaves the current folder at the repository's root and sets BUILD to the folder of the `ci` preset.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
BUILD="$PWD/build/ci"

installed() { [ "$(dpkg-query -W -f='${db:Status-Status}' "$1" 2>/dev/null)" = installed ]; }

# install_missing LIST
install_missing() {
  local missing=() name optional
  while read -r name; do
    optional=0
    case "$name" in '' | '#'*) continue ;; '?'*) optional=1 name="${name#'?'}" ;; esac
    installed "$name" && continue
    if [ "$optional" = 1 ] && [ -z "$(apt-cache policy "$name" 2>/dev/null)" ]; then continue; fi
    missing+=("$name")
  done <"$1"
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

# build PRESET [arguments of cmake --build]
build() {
  local log="build/$1.log"
  [ -f "build/$1/build.ninja" ] || { echo "Configuring $1 (once)"; cmake --preset "$1" >"$log" 2>&1 || { cat "$log" >&2; exit 1; }; }
  cmake --build --preset "$@"
}

# The real recordings: beside this folder, or beside the checkout that this one is a worktree or a clone of.
find_recordings() {
  local git_folder origin beside
  [ -z "${FIELDTRUE_REAL_DATA:-}" ] || return 0
  git_folder="$(git rev-parse --path-format=absolute --git-common-dir 2>/dev/null)" || git_folder="$PWD/.git"
  origin="$(git config --get remote.origin.url 2>/dev/null)" || origin="$PWD"
  for beside in "$PWD" "${git_folder%/*}" "$origin"; do
    [ -d "$beside/../shared/data" ] || continue
    FIELDTRUE_REAL_DATA="$(cd "$beside/../shared/data" && pwd)"
    export FIELDTRUE_REAL_DATA
    return
  done
}

# Runs a command with a display of its own.
on_display() {
  QT_QPA_PLATFORM=xcb xvfb-run --auto-servernum --server-args="-screen 0 1600x1000x24" "$@"
}

# A private folder for Qt, which complains without one.
if [ -z "${XDG_RUNTIME_DIR:-}" ]; then
  XDG_RUNTIME_DIR="$(mktemp -d)"
  export XDG_RUNTIME_DIR
fi
mkdir -p build
install_missing .ci/packages.txt
