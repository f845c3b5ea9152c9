"""Studies of models and recordings, written as tables and self-contained HTML pages."""
