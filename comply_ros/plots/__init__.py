# SPDX-License-Identifier: Apache-2.0
"""Pictures of a training, and the geometry that viewers draw."""
