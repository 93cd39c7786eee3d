"""The console of a run that goes on: one local web page for the instructor, the crews of vessels, and observers."""
