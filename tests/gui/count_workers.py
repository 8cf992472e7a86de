# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in Blender: starts a worker, has it answer, and disables the extension."""

import importlib
import os
import time

import bpy

PACKAGE = "bl_ext.user_default.adaptive_drt"
PATIENCE = 60.0

module = importlib.import_module(f"{PACKAGE}.adaptive_drt.parallel.pool")
module.worker_pool.start_workers(1)
end = time.monotonic() + PATIENCE
while not module.worker_pool.ready_count and time.monotonic() < end:
    time.sleep(0.05)
pid = module.CallGroup().make(module.Call(os.getpid, module.SharedArguments(()), ()))
print("a worker of its own:", pid != os.getpid())
bpy.ops.preferences.addon_disable(module=PACKAGE)
try:
    os.kill(pid, 0)
except ProcessLookupError:
    print("gone with the extension: True")
