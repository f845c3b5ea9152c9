"""Durable segments on one machine or many: a database of jobs, workers, and their control."""
