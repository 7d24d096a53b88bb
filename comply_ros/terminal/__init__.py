# SPDX-License-Identifier: Apache-2.0
"""The command line: options, progress bars, tables, and a map that is drawn in a terminal."""
