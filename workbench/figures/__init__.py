"""Figures of charts by matplotlib, for the report, the session folder and the recording."""
