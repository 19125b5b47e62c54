"""The session folder: journal, frame store, manifest."""
