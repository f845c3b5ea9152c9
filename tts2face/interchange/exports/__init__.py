"""Export of clips and phones to files of other programs: one module for each format."""
