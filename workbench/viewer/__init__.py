"""Rerun recording of a session, made from its records."""

import os

# Before Rerun is imported: it would warn on the terminal of every file without a footer.
os.environ.setdefault("RUST_LOG", "warn,re_log_encoding::rrd::file_sink=error")
