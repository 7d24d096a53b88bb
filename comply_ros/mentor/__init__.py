# SPDX-License-Identifier: Apache-2.0
"""Mentors: policies of every quality, advice budgets, and policies as text."""
