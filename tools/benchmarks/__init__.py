# SPDX-License-Identifier: Apache-2.0
"""Benchmarks, each beside something to compare with: `scripts/benchmark`, docs/performance.md."""
