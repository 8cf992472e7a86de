# SPDX-License-Identifier: GPL-3.0-or-later
"""Threads and worker processes that the calls of a render are distributed over."""
