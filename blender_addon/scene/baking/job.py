# SPDX-License-Identifier: GPL-3.0-or-later
"""One bake from beginning to end, as a generator: the window and the command line both drive it.

Every frame is solved before the scene is written to, and a file takes its name when it is whole;
so closing the generator at any time, or an error, leaves the file and the scene as they were.
"""

from contextlib import closing
from dataclasses import dataclass

from . import bakers, sampling
from .errors import SettingsError
from .frames import frame_numbers, walk

FORMATS = {
    "PC2": bakers.FileBaker,
    "MDD": bakers.FileBaker,
    "SHAPE_KEYS": bakers.ShapeKeyBaker,
    "WEIGHTS": bakers.WeightBaker,
}


@dataclass(frozen=True)
class Settings:
    format: str  # one of FORMATS
    start: int
    end: int
    step: int = 1
    filepath: str = ""  # of PC2 and MDD; "//" is the folder of the .blend file
    use_modifier: bool = True  # PC2 and MDD: set up a Mesh Cache modifier
    stop_live: bool = True  # PC2 and MDD; a bake to keys always stops it


@dataclass(frozen=True)
class Progress:
    frame: int
    done: int
    total: int


@dataclass(frozen=True)
class Result:
    message: str  # what was made, and how well, for the artist
    filepath: str  # absolute; "" for bakes to keys
    frame_count: int
    unconverged: tuple  # frames whose solve met its cap
    misfit: object  # weights.Misfit or None


def run(obj, scene, view_layer, settings):
    """Generator of Progress that returns a Result. Raises BakeError and ExemplarError."""
    if settings.format not in FORMATS:
        raise SettingsError(f"There is no format {settings.format}")
    numbers = frame_numbers(settings.start, settings.end, settings.step)
    unconverged = []
    sample_at = sampling.sampler(obj)
    with FORMATS[settings.format](obj, scene, settings, numbers) as baker:
        with closing(walk(scene, numbers)) as frames:
            for done, frame in enumerate(frames, start=1):
                sample = sample_at(view_layer.depsgraph)
                if not sample.converged:
                    unconverged.append(frame)
                    cap = sample.iterations
                baker.add(sample.positions)
                yield Progress(frame, done, len(numbers))
        message = baker.finish()
    # The new animation or modifier has not been evaluated yet.
    scene.frame_set(scene.frame_current, subframe=scene.frame_subframe)
    if unconverged:
        text = _frames_text(unconverged, len(numbers))
        message += f". {text} stopped at the cap of {cap} iterations"
    return Result(message, baker.path, len(numbers), tuple(unconverged), baker.misfit)


def _frames_text(frames, total):
    if len(frames) == total:
        return "Every frame"
    shown = ", ".join(str(frame) for frame in frames[:4])
    more = f" and {len(frames) - 4} more" if len(frames) > 4 else ""
    return f"Frame{'s' if len(frames) > 1 else ''} {shown}{more}"
