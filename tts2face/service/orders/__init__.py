"""What clients ask for: options and files of clips and jobs, and their checks."""
