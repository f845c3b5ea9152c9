"""The studio: pages in the browser on which a clip is made."""
