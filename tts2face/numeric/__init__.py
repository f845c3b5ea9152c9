"""Numerical methods whose results are equal bits on every machine: solvers, splines, compiled kernels."""
