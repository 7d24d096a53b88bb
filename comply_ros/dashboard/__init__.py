# SPDX-License-Identifier: Apache-2.0
"""A web page that shows a run, controls it, and lets a person be its mentor."""
