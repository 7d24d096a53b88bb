# SPDX-License-Identifier: Apache-2.0
"""Files: maps, policies, checkpoints and journals, results and caches."""
