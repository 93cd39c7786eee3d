"""Validation cases of the source paper, Qiu et al. (2021): its figures 3 to 6, and what it concludes from them."""
