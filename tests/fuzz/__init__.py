"""Random, damaged and hostile input for every entrance of oilsim.

`python -m tests.fuzz` runs the trials. Each runs in a process of its own and may end in success or in an error in words. A traceback, a
crash, more than 10 s, more than 1 GB, or a file left behind is a fault.
"""
