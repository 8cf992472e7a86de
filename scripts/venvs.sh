#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Blender 4.2 and 5.0 as Python modules, each in a virtual environment of its own, outside the
# repository: ${XDG_CACHE_HOME:-~/.cache}/adaptive-drt/bpy-VERSION. Blender 4.5 is in .venv.
# Needs Python 3.11. PYTHON=/path/to/python3.11 chooses one; the versions are pinned below.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
cache=${XDG_CACHE_HOME:-$HOME/.cache}/adaptive-drt
python=${PYTHON:-.venv/bin/python}

# Blender, and the NumPy that it ships
make_venv() {
    local folder=$cache/bpy-$1
    shift
    local wanted="$* embreex==4.4.0.post1 pytest==9.2.0 OpenEXR==3.5.3 hypothesis==6.170.15"
    [[ -f $folder/.ready && $(<"$folder/.ready") == "$wanted" ]] && return
    printf 'venvs: %s with %s\n' "$folder" "$wanted" >&2
    rm -rf "$folder"
    "$python" -m venv "$folder"
    # shellcheck disable=SC2086  # a list of words
    "$folder/bin/python" -m pip install --quiet --disable-pip-version-check --no-input \
        $wanted </dev/null
    "$folder/bin/python" -c 'import bpy, embreex, numpy, OpenEXR' </dev/null >/dev/null
    printf '%s' "$wanted" >"$folder/.ready"
}

mkdir -p "$cache"
make_venv 4.2 bpy==4.2.23 numpy==1.24.3
make_venv 5.0 bpy==5.0.1 numpy==1.26.4
printf 'venvs: ready in %s\n' "$cache" >&2
