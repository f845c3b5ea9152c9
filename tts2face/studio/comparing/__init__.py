"""What a project is compared with."""
