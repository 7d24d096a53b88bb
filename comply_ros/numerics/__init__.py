# SPDX-License-Identifier: Apache-2.0
"""Compiled kernels, random numbers and action values; imports numpy, and numba in one file."""
