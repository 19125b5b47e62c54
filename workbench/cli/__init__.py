"""Commands, terminal output and prompts; nothing else talks to a person."""
