"""The script that makes every shipped model; in the repository only."""
