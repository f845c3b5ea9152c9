"""The studio: projects in the browser, edited over time, shown at once, and rendered (docs/studio.md)."""
