#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# What only `make bench` needs: bench_setup.sh [folder of the venv]. Mitsuba from the package index,
# and LLVM's library, 16 or newer, for its compiled variants: the system's if it is there, else
# Debian's, unpacked in the user's cache folder (no root). Without it Mitsuba runs its scalar
# variant, which is slower, and the report names it.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"
venv=${1:-../.venv}
cache=${XDG_CACHE_HOME:-$HOME/.cache}/adaptive-drt/llvm

say() { printf '%s\n' "$*" >&2; }

"$venv/bin/python" -m pip install --quiet --disable-pip-version-check --no-input \
    --requirement requirements.txt </dev/null
"$venv/bin/python" peer_mitsuba.py --check && exit 0
say "bench: LLVM 16 or newer is needed for Mitsuba; fetching Debian's"
mkdir -p "$cache"
cd "$cache"
for version in 19 16 21 20 18 17; do
    if apt-get download -qq "libllvm$version" 2>/dev/null; then
        dpkg -x "libllvm${version}"_*.deb . && rm -f "libllvm${version}"_*.deb
        break
    fi
done
cd - >/dev/null
"$venv/bin/python" peer_mitsuba.py --check ||
    say "bench: no LLVM; Mitsuba renders with its scalar variant. Debian: apt-get install libllvm19,
  elsewhere set DRJIT_LIBLLVM_PATH to libLLVM"
