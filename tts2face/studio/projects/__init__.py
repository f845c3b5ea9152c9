"""Projects: edits, previews, files, and where they are kept."""
