# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel in the 3D view's sidebar. One file per section, in the order of work."""
