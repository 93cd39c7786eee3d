"""The oils that a scenario may name: a cleaned copy of NOAA's ADIOS oil library, and its oils at a temperature and a weathered state."""
