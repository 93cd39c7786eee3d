"""The scheme of Qiu et al. 2021 (Alg. 3) as published, errata mended, to compare with."""
