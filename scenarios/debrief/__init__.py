"""The debrief of an exercise: one page made from a recording alone, with figures, pictures and a grade with its reasons."""
