# SPDX-License-Identifier: GPL-3.0-or-later
"""Threads and worker processes that calls are shared among."""
