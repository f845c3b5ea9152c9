"""Pages for people to look at: one HTML file each, with nothing outside it."""
