"""Parts of a page that run in the browser: the stage with the head, and the timeline."""
