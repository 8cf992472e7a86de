#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Blender as a program, with all it needs, in a folder of its own outside the repository:
# ${XDG_CACHE_HOME:-~/.cache}/adaptive-drt/blender-VERSION, a small Debian.
#
#   scripts/blender.sh build VERSION         make it, unless it is there: about 2 minutes, 2 GB
#   scripts/blender.sh folder VERSION        say where it is; 1 if it is not
#   scripts/blender.sh run VERSION COMMAND…  run a command in it, such as blender --version
#
# VERSION is 5.2 (Debian sid, which moves on: the folder stays as it was built) or 4.3 (Debian 13).
# Needs debootstrap and root. The folder's mounts end with the command that needed them.
set -euo pipefail

say() { printf '%s\n' "$*" >&2; }
fail() { say "blender: $*"; exit 1; }

packages=(blender
    # what Debian's Blender forgets to ask for: the extension system does not start without them
    python3-numpy python3-cattr python3-requests python3-zstandard
    # a window, and hands and eyes for it
    libegl1 libegl-mesa0 libgl1-mesa-dri xvfb xdotool scrot)

suite_of() {
    case $1 in
        5.2) echo sid ;;
        4.3) echo trixie ;;
        *) fail "there is no Blender $1 here, only 5.2 and 4.3" ;;
    esac
}

inside() {  # a command in the folder, with /proc for as long as it runs
    local root=$1
    shift
    # shellcheck disable=SC2016  # the inner shell's own arguments
    unshare --mount -- bash -c \
        'mount -t proc proc "$0/proc" && exec chroot "$0" /usr/bin/env -i HOME=/srv \
            PATH=/usr/sbin:/usr/bin:/sbin:/bin LANG=C.UTF-8 DEBIAN_FRONTEND=noninteractive "$@"' \
        "$root" "$@"
}

build() {
    local root=$1 suite
    suite=$(suite_of "$2")
    [[ -f $root/.ready ]] && { say "blender: $(<"$root/.ready") in $root"; return; }
    [[ $(id -u) == 0 ]] || fail "debootstrap needs root"
    command -v debootstrap >/dev/null || fail "debootstrap is missing: apt-get install debootstrap"
    rm -rf "$root"
    mkdir -p "$root"
    say "blender: Debian $suite into $root"
    debootstrap --variant=minbase "$suite" "$root" "${MIRROR:-http://deb.debian.org/debian}" \
        </dev/null >"$root.log" 2>&1 || fail "see $root.log"
    inside "$root" apt-get install -y -qq --no-install-recommends "${packages[@]}" \
        </dev/null >>"$root.log" 2>&1 || fail "see $root.log"
    inside "$root" apt-get clean
    local version
    version=$(inside "$root" blender --version </dev/null | head -n 1)
    [[ $version == "Blender $2"* ]] || say "blender: Debian $suite has $version by now, not $2"
    echo "$version" >"$root/.ready"
    say "blender: $version is ready in $root"
}

[[ $# -ge 2 ]] || fail "usage: blender.sh build|folder|run VERSION [COMMAND…]"
action=$1 version=$2
shift 2
root=${XDG_CACHE_HOME:-$HOME/.cache}/adaptive-drt/blender-$version
case $action in
    build) build "$root" "$version" ;;
    folder) [[ -f $root/.ready ]] && echo "$root" ;;
    run) [[ -f $root/.ready ]] || fail "it is not there: make blender"; inside "$root" "$@" ;;
    *) fail "unknown: $action" ;;
esac
