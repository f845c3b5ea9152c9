"""Transcripts with times: label tables, TextGrids and annotation files of other programs, as words with seconds."""
