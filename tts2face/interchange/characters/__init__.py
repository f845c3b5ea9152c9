"""Characters of other programs: import as faces, and export of animation onto them."""
