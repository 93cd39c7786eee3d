"""Run the recorded cases from the command line."""

import sys

from tests.regression.record import main

sys.exit(main(sys.argv[1:]))
