#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Set up the virtual environment: scripts/setup.sh [folder], .venv by default.
# Needs Python 3.11, since the pinned bpy is built for it. PYTHON=/path/to/python3.11 chooses one.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
venv=${1:-.venv}

say() { printf '%s\n' "$*" >&2; }
fail() { say "setup: $*"; exit 1; }
is_311() { "$1" -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11))' 2>/dev/null; }

find_python() {
    local candidate
    for candidate in ${PYTHON:-} python3.11 python3; do
        if is_311 "$candidate"; then
            command -v "$candidate"
            return
        fi
    done
    fail "Python 3.11 is needed (bpy 4.5 is built for it), and neither python3.11 nor python3 is.
  Debian 12:    apt-get install python3 python3-venv
  elsewhere:    install it (pyenv install 3.11, uv python install 3.11), then
                make venv PYTHON=/path/to/python3.11"
}

make_venv() {
    if [[ -e $venv ]] && ! is_311 "$venv/bin/python"; then
        say "setup: $venv is not of Python 3.11; it is made again"
        rm -rf "$venv"
    fi
    "$venv/bin/python" -m pip --version >/dev/null 2>&1 && return
    local python
    python=$(find_python)
    say "setup: $venv from $python"
    "$python" -c 'import ensurepip, venv' 2>/dev/null ||
        fail "$python cannot make virtual environments. Debian: apt-get install python3-venv"
    "$python" -m venv "$venv"
}

install_packages() {
    say "setup: installing the pinned packages (bpy alone is about 350 MB)"
    "$venv/bin/python" -m pip install --quiet --disable-pip-version-check --no-input \
        --requirement requirements.txt --requirement requirements-dev.txt </dev/null
}

missing_libraries() {
    local module
    module=$("$venv/bin/python" -c \
        'import importlib.util as u; print(u.find_spec("bpy").submodule_search_locations[0])')
    find "$module" -maxdepth 1 -name '*.so' -exec ldd {} + 2>/dev/null |
        awk '/not found/ {print $1}' | sort -u
}

# Blender as a module links to X and OpenGL even when it opens no window; a minimal Debian or
# Ubuntu has neither.
install_libraries() {
    command -v ldd >/dev/null || return 0
    local missing
    missing=$(missing_libraries)
    [[ -z $missing ]] && return
    local packages=(libx11-6 libxext6 libxfixes3 libxi6 libxkbcommon0 libxrender1 libsm6 libice6
        libgl1)
    say "setup: Blender's module needs system libraries:" $missing
    if [[ $(id -u) == 0 ]] && command -v apt-get >/dev/null; then
        export DEBIAN_FRONTEND=noninteractive
        apt-get update -qq </dev/null
        apt-get install -y -qq --no-install-recommends "${packages[@]}" </dev/null >/dev/null
    else
        fail "install them, then run make again. Debian:
  sudo apt-get install ${packages[*]}"
    fi
    missing=$(missing_libraries)
    [[ -z $missing ]] || fail "still missing: $missing"
}

make_venv
install_packages
install_libraries
"$venv/bin/python" -c 'import bpy, embreex, numpy' </dev/null >/dev/null ||
    fail "the installed packages cannot be imported"
say "setup: $venv is ready"
