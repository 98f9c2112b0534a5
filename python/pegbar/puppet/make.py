"""From a picture with joints and a clip to a puppet (Hornung et al. 2007, sections 5 and 6)."""

from __future__ import annotations

from collections.abc import Sequence

from pegbar.scene.motion import Motion
from pegbar.scene.puppet import Puppet
from pegbar.scene.puppet_input import PuppetInput


def make_puppet(
    source: PuppetInput,
    motion: Motion,
    *,
    clip: str = "",
    view: str | None = None,
    layer_order: Sequence[str] | None = None,
    field_of_view: float | None = None,
    background: bool = True,
) -> Puppet:
    """Make a puppet of the figure in a picture: camera and pose from a clip, layers, mesh, textures."""
    raise NotImplementedError
