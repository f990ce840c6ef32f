# SPDX-License-Identifier: GPL-3.0-or-later
"""What the artist can do. One file per feature."""
