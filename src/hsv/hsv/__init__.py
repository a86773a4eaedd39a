"""Model, design, control and recording of a flexible air-breathing hypersonic vehicle; needs no ROS."""

import os

# All matrices are small: threads in the linear algebra only wait for each other, and their number changes last bits.
# Read once, when numpy is imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
