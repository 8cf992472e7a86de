# SPDX-License-Identifier: GPL-3.0-or-later
"""What is rendered, how, and what comes of it: plain records, and what they are made from."""
