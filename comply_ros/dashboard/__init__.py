# SPDX-License-Identifier: Apache-2.0
"""A page in the browser: to see a lesson, and to be its mentor."""
