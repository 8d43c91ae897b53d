"""What the programs that read exports want to be told before they are imported."""

import os

# pymavlink speaks the protocol of 2013 unless it is told so before its first import
os.environ.setdefault("MAVLINK20", "1")
