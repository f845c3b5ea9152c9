"""Projects: everything that makes one clip, in one JSON file that is edited and rendered again and again."""
