"""Names of shapes of faces: one table a program, in the form of a mapping, with its source."""
