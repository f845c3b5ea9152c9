"""Files of other programs: exports, characters, glTF and subtitles."""
