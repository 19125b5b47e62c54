import os

# As the command line does. Two workers with two threads each on two cores spend most of their time waiting.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
