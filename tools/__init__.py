# SPDX-License-Identifier: Apache-2.0
"""Tools of this repository, started by `scripts/`. They are not installed."""
