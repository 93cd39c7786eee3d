"""A debrief page made from a recording alone: what happened, in figures and pictures, and a grade with its reasons."""
