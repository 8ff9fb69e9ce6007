"""What every test process needs."""

import signal

# A shell that starts the tests in the background leaves SIGINT ignored, and what they start in
# turn would ignore it, too.
signal.signal(signal.SIGINT, signal.default_int_handler)
