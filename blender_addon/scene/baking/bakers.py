# SPDX-License-Identifier: GPL-3.0-or-later
"""The ways to keep a bake. Each checks first, takes sample after sample, and writes at the end."""

import os

import bpy
import numpy as np

from .. import exemplars, fingerprint, meshes, results, versions
from . import curves, mdd, pc2, playback, sampling, shape_keys, weights
from .errors import SettingsError

EXTENSIONS = {"PC2": ".pc2", "MDD": ".mdd"}


class Baker:
    """What run() in job.py expects: enter, add() for each frame in order, finish(), exit."""

    path = ""
    misfit = None

    def __init__(self, obj, scene, settings, frames):
        self.obj = obj
        self.settings = settings
        self.frames = frames

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def add(self, positions):
        """positions  float32 [V][3], object space"""
        raise NotImplementedError

    def finish(self):
        """Put the bake in place. Returns a sentence about it, without its full stop."""
        raise NotImplementedError


class FileBaker(Baker):
    """PC2 and MDD, streamed: memory does not grow with the number of frames."""

    def __init__(self, obj, scene, settings, frames):
        super().__init__(obj, scene, settings, frames)
        self.path = absolute_path(default_path(obj, settings))
        vertex_count = len(obj.data.vertices)
        if settings.format == "PC2":
            header = pc2.Header(vertex_count, len(frames), frames.start, frames.step)
            self._writer = pc2.writer(self.path, header)
        else:
            fps = scene.render.fps / scene.render.fps_base
            times = (np.asarray(frames, dtype=np.float64) - frames.start) / fps
            self._writer = mdd.writer(self.path, mdd.Header(vertex_count, times))

    def __enter__(self):
        self._writer.__enter__()
        return self

    def __exit__(self, *_):
        self._writer.__exit__()

    def add(self, positions):
        self._writer.append(positions)

    def finish(self):
        self._writer.finish()
        if self.settings.use_modifier:
            stored = default_path(self.obj, self.settings)
            playback.play_file(self.obj, stored, self.settings.format, self.frames)
        if self.settings.stop_live:
            sampling.set_live(self.obj, False)
        return f"Baked {len(self.frames)} frames to {self.path}"


class ShapeKeyBaker(Baker):
    def __init__(self, obj, scene, settings, frames):
        super().__init__(obj, scene, settings, frames)
        self._player = results.shown_object(obj)
        check_keys(self._player)
        self._samples = []

    def add(self, positions):
        self._samples.append(positions.copy())

    def finish(self):
        basis = meshes.reference_positions(self.obj)
        blocks = shape_keys.write(self._player, self.frames, self._samples, basis)
        playback.play_keys(self.obj, self._player, blocks)
        return f"Baked {len(blocks)} frames to as many shape keys of {self._player.name}"


class WeightBaker(Baker):
    """Values of the exemplars' own keys. The keys themselves are only read."""

    def __init__(self, obj, scene, settings, frames):
        super().__init__(obj, scene, settings, frames)
        check_keys(obj)
        self._blocks = weight_keys(obj)
        basis = versions.get_key_positions(obj.data.shape_keys.reference_key)
        deltas = np.stack([key_delta(obj, block) for block in self._blocks])
        lower = [block.slider_min for block in self._blocks]
        upper = [block.slider_max for block in self._blocks]
        self._fit = weights.KeyFit(basis, deltas, lower, upper)
        self._diagonal = float(np.linalg.norm(np.ptp(basis, axis=0)))
        self._values = []
        self._errors = weights.ErrorSum()

    def add(self, positions):
        values, distances = self._fit.fit(positions)
        self._errors.add(self.frames[len(self._values)], distances)
        self._values.append(values)

    def finish(self):
        key = self.obj.data.shape_keys
        for block, values in zip(self._blocks, np.transpose(self._values)):
            curves.set_linear(key, block, self.frames, values)
        playback.play_keys(self.obj, self.obj, self._blocks)
        self.misfit = self._errors.misfit(self._diagonal)
        return (
            f"Baked {len(self.frames)} frames to the values of {len(self._blocks)} shape keys; "
            f"off by {self.misfit.rms:.2%} of the mesh's size on average, at most "
            f"{self.misfit.largest:.2%} on frame {self.misfit.worst_frame}"
        )


# ------------------------------------------------------------------------------------------- paths


def default_path(obj, settings):
    """The path as it is to be stored: what was asked for, or //<object>.<format>."""
    extension = EXTENSIONS[settings.format]
    if not settings.filepath:
        return f"//{bpy.path.clean_name(obj.name)}{extension}"
    stem, found = os.path.splitext(settings.filepath)
    if found.lower() == extension:
        return settings.filepath
    # A name left over from the other format gets the right ending, any other name is kept whole.
    return (stem if found.lower() in EXTENSIONS.values() else settings.filepath) + extension


def absolute_path(path):
    if path.startswith("//") and not bpy.data.filepath:
        raise SettingsError(
            f"{path} lies beside the .blend file, which has not been saved yet: "
            "save it, or give a full path"
        )
    return os.path.abspath(bpy.path.abspath(path))


# -------------------------------------------------------------------------------------------- keys


def check_keys(obj):
    """Raise what stands in the way of writing keys or their values."""
    key = obj.data.shape_keys
    if obj.data.library is not None or (key is not None and key.library is not None):
        raise SettingsError(f"The mesh of {obj.name} is linked; its shape keys cannot be animated")
    if key is not None and not key.use_relative:
        raise SettingsError(f"The shape keys of {obj.name} are absolute; switch on Relative")


def weight_keys(obj):
    """The shape keys whose values a bake of weights animates: the exemplars but the Basis."""
    keys = obj.data.shape_keys
    if keys is None:
        raise SettingsError(
            f"{obj.name} has no shape keys to give values to: bake it to a file, or to shape keys"
        )
    # A deformer without exemplars can be written as values of keys all the same.
    names = fingerprint.names(obj) or exemplars.enabled_names(obj)
    bound = [keys.key_blocks[name] for name in names]
    blocks = [block for block in bound if block != keys.reference_key]
    if not blocks:
        raise SettingsError(f"{obj.name} has no exemplar beside its Basis to give a value to")
    for block in blocks:
        if curves.is_driven(keys, block):
            raise SettingsError(
                f"The value of shape key {block.name} has a driver, which would win over the bake: "
                "remove it, or switch the exemplar off"
            )
    return blocks


def key_delta(obj, block):
    """What value 1 of a key adds to the mesh, float32 [V][3]."""
    delta = versions.get_key_positions(block) - versions.get_key_positions(block.relative_key)
    if block.vertex_group:
        delta *= meshes.group_weights(obj, block.vertex_group)[:, None]
    return delta
