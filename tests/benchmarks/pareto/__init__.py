"""Run time against error: this solver's settings and, where it is installed, SPlisHSPlasH's, on the same scenes."""
