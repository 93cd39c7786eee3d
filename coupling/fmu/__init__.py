"""FMUs as participants, and participants as FMUs."""
