# SPDX-License-Identifier: Apache-2.0
"""One session of learning, from its options to its results: maps, mentors, files, pictures."""
