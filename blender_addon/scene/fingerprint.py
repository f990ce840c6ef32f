# SPDX-License-Identifier: GPL-3.0-or-later
"""What a bind was made from, in digests: small enough to be saved, and precise enough to say which
exemplar was edited since."""

import functools
import json

from ..native import Element, ExemplarError
from . import meshes, versions

REBIND = "Press Rebind."


def of(inputs):
    """JSON, the same for the same inputs."""
    return json.dumps(
        {
            "deformer": inputs.deformer,
            "settings": inputs.settings,
            "vertices": len(inputs.reference),
            "topology": inputs.topology,
            "reference": meshes.digest(inputs.reference),
            "exemplars": [
                [name, meshes.digest(positions)]
                for name, positions in zip(inputs.names, inputs.exemplars)
            ],
            "handles": [
                [kind, meshes.digest(vertices)]
                for kind, vertices in zip(inputs.kinds, inputs.vertex_sets)
            ],
        }
    )


def read(obj):
    """What of() wrote at the last Bind. Not to be changed."""
    return _parse(obj.exemplar.fingerprint)


@functools.lru_cache(maxsize=64)
def _parse(text):
    # Asked for at every frame and every redraw.
    return json.loads(text)


def names(obj):
    """The exemplars of the bind by the names that they have now, found by content if renamed.

    Raises ExemplarError where one is gone.
    """
    bound = read(obj)["exemplars"]
    present = {key.name: key for key in meshes.exemplar_keys(obj)}
    known = {name for name, _ in bound}
    strangers = {}
    found = []
    for index, (name, digest) in enumerate(bound):
        if name in present:
            found.append(name)
            continue
        if not strangers:
            strangers = {
                meshes.digest(versions.get_key_positions(key)): other
                for other, key in present.items()
                if other not in known
            }
        if digest not in strangers:
            raise ExemplarError(
                f"Exemplar '{name}' was removed since Bind. {REBIND}",
                element=Element.EXEMPLAR,
                index=index,
            )
        found.append(strangers[digest])
    return found


def check_size(obj):
    """Before anything relies on it."""
    bound = read(obj)
    count = len(obj.data.vertices)
    if count != bound["vertices"]:
        raise ExemplarError(
            f"The mesh had {bound['vertices']} vertices at Bind and has {count} now. {REBIND}"
        )


def check(obj, inputs):
    """Raise ExemplarError that says what differs from the bind."""
    bound, now = read(obj), json.loads(of(inputs))
    if now["topology"] != bound["topology"]:
        raise ExemplarError(
            "The faces of the mesh were changed since Bind, "
            f"though it has as many vertices as before. {REBIND}"
        )
    if now["reference"] != bound["reference"]:
        raise ExemplarError(f"{meshes.reference_name(obj)} was edited since Bind. {REBIND}")
    for index, ((_, before), (name, after)) in enumerate(zip(bound["exemplars"], now["exemplars"])):
        if before != after:
            raise ExemplarError(
                f"Exemplar '{name}' was edited since Bind. {REBIND}",
                element=Element.EXEMPLAR,
                index=index,
            )
    if len(now["handles"]) != len(bound["handles"]):
        raise ExemplarError(f"A handle was removed since Bind. {REBIND}")
    for index, (before, after) in enumerate(zip(bound["handles"], now["handles"])):
        if before != after:
            raise ExemplarError(
                f"The vertices of handle '{inputs.labels[index]}' changed since Bind. {REBIND}",
                element=Element.HANDLE,
                index=index,
            )
