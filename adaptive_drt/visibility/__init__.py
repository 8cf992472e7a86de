# SPDX-License-Identifier: GPL-3.0-or-later
"""What is visible along lines through pixel and shutter, between exact events."""
