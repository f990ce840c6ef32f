# SPDX-License-Identifier: GPL-3.0-or-later
"""What can go wrong in a bake, by whose move it is. The text of each is a sentence for the
artist."""


from ...native import ExemplarError


class BakeError(ExemplarError):
    """A bake did not happen; the previous file and the scene are as they were."""


class SettingsError(BakeError):
    """The settings ask for something that cannot be baked."""


class WriteError(BakeError):
    """The file cannot be written: folder, permission, space."""


class ReadError(BakeError):
    """A cache file is not what it says it is."""
