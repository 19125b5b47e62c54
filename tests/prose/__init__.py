"""Prose linter: words to avoid and long sentences in Markdown files and in the text of Python modules."""
