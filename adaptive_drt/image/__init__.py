# SPDX-License-Identifier: GPL-3.0-or-later
"""The picture as a whole: first pass, interpolation over blocks, buffers and the order of work."""
