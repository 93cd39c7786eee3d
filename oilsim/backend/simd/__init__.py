"""Vector arithmetic, LANES numbers at a time: how kernels loop over the neighbours of a particle.

A particle has some 70 neighbours. Compilers unroll such a loop to rounds of 64 and leave the rest to scalar code, and they give up on
loops that store. So kernels state that they take LANES neighbours a round; the last round may be incomplete:

    for k in range(first, last, LANES):
        present = below(last, k)
        j = load(neighbor, k, present)
        sum += load(gradient, k, present) * gather(kappa, j)
    result = summed(sum)

Lanes and float32 scalars mix under + - * / and unary minus. A double is refused, so that none can slip in. Where the compiler is switched
off the same functions run on numpy arrays; compiled they become LLVM's portable vector operations. On a processor with one lane the same
kernels would run with LANES = 1.
"""

from oilsim.backend.simd.memory import below, gather, gather_four, load, store
from oilsim.backend.simd.types import LANES, above_zero, floor, only, positive, root, rounded, spread, summed

__all__ = [
    "LANES", "above_zero", "below", "floor", "gather", "gather_four", "load", "only", "positive", "root", "rounded", "spread", "store",
    "summed",
]  # fmt: skip
