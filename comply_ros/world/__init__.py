# SPDX-License-Identifier: Apache-2.0
"""Worlds to learn in: grids, their Markov decision processes, reachability and planning."""
