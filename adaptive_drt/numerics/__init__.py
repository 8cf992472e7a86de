# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers, arrays, jets and vectors: mathematics that knows nothing of rendering."""
