"""Builds the shipped faces from the CC0 data of MakeHuman."""
