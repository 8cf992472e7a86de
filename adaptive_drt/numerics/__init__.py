# SPDX-License-Identifier: GPL-3.0-or-later
"""Array types, automatic differentiation, vectors and quadrature points; nothing of rendering."""
