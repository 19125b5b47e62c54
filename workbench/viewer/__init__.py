"""The Rerun recording: a view made from the session's records."""
