"""Recovery of oil: skimmers, their storage, and the planning formulas by which they are rated."""
