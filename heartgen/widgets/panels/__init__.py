"""The panels: each draws one step of the session's state, and hands on what the user does."""
