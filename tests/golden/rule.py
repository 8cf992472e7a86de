# SPDX-License-Identifier: GPL-3.0-or-later
"""When pictures of two environments are one: the rule where no digests are known.

Other processors, C libraries and versions of NumPy round sines, sums and eigenvalues otherwise in
the last bit. So pictures are one if

- all of a pixel is the same but for last bits: each colour differs by at most `Case.last_bits` of
  the picture's mean colour, alpha and the normal's components by at most `Case.last_bits`, the
  depth by that part of itself; mask and samples are equal;
- but for `SHARE` of the pixels, or one: there an adaptive decision (to flag, to split) may have
  fallen otherwise, for what it compares differs in last bits too. Mask and samples may then be
  others, and each colour may be off by the tolerance of the picture's mean, alpha by the tolerance;
- the estimate of the error differs by at most `ESTIMATE` of itself, for such a pixel counts in it.

A black picture has to be black.
"""

import math

import numpy as np

__all__ = ["broken", "difference", "state_of"]

SHARE = 0.01
"""Of the pixels. Seen: none, but one in each of two pictures whose colour was off by 4e-13."""
ESTIMATE = 1e-2
"""Of the estimate. Seen: 1e-4."""


def difference(arrays, other):
    """Largest difference of colours in units of the other picture's mean; inf if shapes differ."""
    if arrays["color"].shape != other["color"].shape:
        return math.inf
    mean = float(np.abs(other["color"]).mean())
    most = float(np.abs(arrays["color"] - other["color"]).max())
    return most / mean if mean > 0.0 else (math.inf if most > 0.0 else 0.0)


def broken(case, arrays, reference):
    """What in the arrays of a case breaks the rule, in words: (), if they keep it."""
    for name, array in reference.items():
        if (array.dtype, array.shape) != (arrays[name].dtype, arrays[name].shape):
            return (f"{name} is {arrays[name].dtype}{arrays[name].shape}",)
    mean = float(np.abs(reference["color"]).mean())
    last, tolerance = case.last_bits, case.settings.tolerance
    off = {name: _off(arrays[name], reference[name]) for name in reference if name != "estimate"}
    deep = np.abs(reference["depth"])
    bounds = {"color": mean * last, "alpha": last, "normal": last, "depth": last * deep}
    loose = {"color": mean * tolerance, "alpha": tolerance}
    other = np.zeros(deep.shape, dtype=np.bool_)
    for name, values in off.items():
        other |= ~(values <= bounds.get(name, 0.0))
    found = []
    if other.sum() > max(1, int(SHARE * other.size)):
        found.append(f"{other.sum()} of {other.size} pixels differ by more than last bits")
    found += [
        f"{name} is off by {off[name].max():.2e}, more than {bound:.2e}"
        for name, bound in loose.items()
        if not (off[name] <= bound).all()
    ]
    estimate, was = float(arrays["estimate"][0]), float(reference["estimate"][0])
    if not abs(estimate - was) <= ESTIMATE * was:
        found.append(f"the estimated error is {estimate:.6e}, and was {was:.6e}")
    return tuple(found)


def _off(one, other):
    """Differences (height, width) of arrays: of their planes the largest."""
    off = np.abs(one.astype(np.float64) - other.astype(np.float64))
    return off.max(axis=0) if off.ndim == 3 else off


def state_of(case, arrays, digests, stored, known):
    """What became of a case since it was written, and the names of arrays or reasons that say so.

    Parameters
    ----------
    arrays, digests : of the picture as it is.
    stored : arrays, from any environment; None if there are none.
    known : this environment's digests; None if there are none.

    Returns
    -------
    'same' or 'CHANGED'; 'added' where only the digests are lacking; 'new' where all is.
    """
    if stored is None:
        return "new", ()
    if known is not None:
        other = tuple(name for name in digests if digests[name] != known.get(name))
        return ("CHANGED" if other else "same"), other
    reasons = broken(case, arrays, stored)
    return ("CHANGED" if reasons else "added"), reasons
