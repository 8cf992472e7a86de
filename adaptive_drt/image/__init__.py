# SPDX-License-Identifier: GPL-3.0-or-later
"""The picture as a whole: first pass, blocks, working frame and the order of work."""
