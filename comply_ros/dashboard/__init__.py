# SPDX-License-Identifier: Apache-2.0
"""The web page that shows a lesson and lets a person be its mentor."""
