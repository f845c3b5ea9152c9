"""Video analysis: landmarks and head pose of faces in pictures."""
