#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Blender in a window on a display that nobody sees: window.sh SCENE.blend SCRIPT.py FOLDER
# (- for SCENE.blend: the factory's own scene)
cd "$3" || exit 1
rm -f display  # of an earlier run
# -displayfd lets the server choose a number that is free
Xvfb -displayfd 3 -screen 0 1600x1000x24 -nolisten tcp 3>display 2>xvfb.log &
server=$!
for _ in 1 2 3 4 5 6 7 8 9 10; do
    [ -s display ] && break
    sleep 0.3
done
[ -s display ] || { cat xvfb.log >&2; kill $server; exit 1; }
scene=$1
[ "$scene" = - ] && scene=
# shellcheck disable=SC2086  # no scene is no argument
DISPLAY=:$(cat display) LIBGL_ALWAYS_SOFTWARE=1 timeout 240 \
    "${ADAPTIVE_DRT_BLENDER:-blender}" --gpu-backend opengl --window-geometry 0 0 1600 1000 \
    $scene -P "$2" -- "$3"
code=$?
kill $server
exit $code
