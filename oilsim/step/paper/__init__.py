"""The scheme of Qiu et al. 2021 (Alg. 3) as published, errata repaired, to compare with."""
