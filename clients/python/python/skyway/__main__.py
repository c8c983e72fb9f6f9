"""`python -m skyway`: the program that the wheel brings."""

import signal
import sys

from . import _skyway

if not hasattr(_skyway, "run"):
    sys.exit("this wheel was built without the program; build it with its default features")
# Ctrl-C ends a command as it does outside of Python; those that serve take the signal themselves.
signal.signal(signal.SIGINT, signal.SIG_DFL)
sys.exit(_skyway.run(["skyway", *sys.argv[1:]]))
